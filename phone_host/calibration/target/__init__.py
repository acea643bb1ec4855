"""The calibration target: printed, named, found in images, and its corners there. Imports no other room of the calibration."""
