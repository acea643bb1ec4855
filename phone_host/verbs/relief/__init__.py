"""phone-host relief: its options (light), and its command."""
