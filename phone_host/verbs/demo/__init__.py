"""phone-host demo: its options (light), and its command."""
