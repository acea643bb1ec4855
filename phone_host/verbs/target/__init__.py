"""phone-host target: its options (light), and its command."""
