"""phone-host calibrate-time: its options, light, and what it does with them."""
