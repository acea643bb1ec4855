"""phone-host settings: its options, light, and what it does with them."""
