"""phone-host pair: its options, light, and what it does with them."""
