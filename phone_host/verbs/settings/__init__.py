"""phone-host settings: its options (light), and its command."""
