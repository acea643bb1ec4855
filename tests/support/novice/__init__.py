"""A person who has never calibrated anything: a board in two hands before two cameras, and a head that hears only words."""
