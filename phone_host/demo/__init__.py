"""phone-host demo: both programs on this machine before a scene whose depth is known."""
