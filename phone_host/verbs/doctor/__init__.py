"""phone-host doctor: its options (light), and its command."""
