"""Presents a run as text, as JSON and as a page."""
