"""phone-host demo: runs both programs on this machine with a scene whose depth is known."""
