"""Sources of still-encoded frames: one class for each kind, all with the same behaviour."""
