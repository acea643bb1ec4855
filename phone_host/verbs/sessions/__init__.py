"""phone-host sessions: its options (light), and its command."""
