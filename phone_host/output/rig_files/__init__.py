"""Calibrations as other programs keep them: read with every value checked, and written. rig.yaml itself is `output.rig_yaml`."""
