"""A calibration as its request describes it, whoever asks: from pictures, live, or by another program."""
