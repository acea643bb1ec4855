"""phone-host keys: its options (light), and its command."""
