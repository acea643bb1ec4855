"""phone-host run: its options, light, and what it does with them."""
