"""The root behind the page: what runs now, and what may come next."""
