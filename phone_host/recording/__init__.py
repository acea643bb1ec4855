"""What both cameras saw, kept for later."""
