"""phone-host printcheck: its options (light), and its command."""
