"""The host's daemon and tools: pairs frames of two cameras, computes depth and measures every delay."""
