"""phone-host record: its options (light), and its command."""
