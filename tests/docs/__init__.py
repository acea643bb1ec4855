"""What makes the documentation from the code, and what the site adds to it."""
