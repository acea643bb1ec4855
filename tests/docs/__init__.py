"""Generates documentation from the code, and extends the site."""
