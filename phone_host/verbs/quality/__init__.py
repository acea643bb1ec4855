"""phone-host quality: its options (light), and its command."""
