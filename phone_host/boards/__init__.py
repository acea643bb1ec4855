"""The host's boards: how one is found, and how the two come to know each other."""
