"""Roots of what a person does live with both cameras: calibrate. They put `run`, `stream` and `calibration` together; nothing reaches into them."""
