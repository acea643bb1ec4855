"""A run as text, as JSON and as a page."""
