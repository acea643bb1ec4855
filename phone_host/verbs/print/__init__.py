"""phone-host print: its options (light), and its command."""
