"""phone-host stereo: its options (light), and its command."""
