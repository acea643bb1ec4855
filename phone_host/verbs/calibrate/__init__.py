"""phone-host calibrate: its options, light, and what it does with them."""
