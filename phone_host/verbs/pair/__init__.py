"""phone-host pair: its options (light), and its command."""
