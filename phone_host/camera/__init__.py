"""Host cameras that are not kernel devices. They are opened by the same kind of URI and read by the same protocol."""
