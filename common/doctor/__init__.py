"""What a `doctor` verb finds out about a machine: pure checks that judge readings, and thin shells that read /sys, /proc and /dev."""
