"""phone-host measure: its options (light), and its command."""
