"""Guides a person who calibrates live: which views are taken, which are wanted next, when it is enough. Pure."""
