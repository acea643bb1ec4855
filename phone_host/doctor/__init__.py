"""phone-host doctor: finds what prevents a good run on this machine."""
