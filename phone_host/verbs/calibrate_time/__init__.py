"""phone-host calibrate-time: its options (light), and its command."""
