"""phone-host calibrate: its options (light), and its command."""
