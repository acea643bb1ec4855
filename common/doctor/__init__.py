"""What a `doctor` verb examines: pure checks judge readings; thin shells read /sys, /proc and /dev."""
