"""phone-host run: its options (light), and its command."""
