"""The host's own camera where it is none of the kernel's: opened by the same kind of URI, read by the same protocol."""
