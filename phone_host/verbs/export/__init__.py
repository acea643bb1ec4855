"""phone-host export: its options (light), and its command."""
