"""phone-host keys: its options, light, and what it does with them."""
