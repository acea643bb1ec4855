"""phone-host serve: its options (light), and its command."""
