"""phone-host demo: its options, light, and what it does with them."""
