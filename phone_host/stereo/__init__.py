"""The stereo core: calibration, rectification, matching, reprojection. Pure functions on arrays."""
