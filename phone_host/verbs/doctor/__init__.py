"""phone-host doctor: its options, light, and what it does with them."""
