"""Whether a rig still stands as it was calibrated, from natural features while it runs. Pure."""
