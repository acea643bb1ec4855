"""phone-host stereo: its options, light, and what it does with them."""
