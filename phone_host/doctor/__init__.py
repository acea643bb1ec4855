"""phone-host doctor: what keeps this machine from a good run."""
