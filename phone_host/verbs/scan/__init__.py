"""phone-host scan: its options (light), and its command."""
