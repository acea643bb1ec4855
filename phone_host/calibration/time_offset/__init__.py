"""Measures the time offset, the constant between two cameras' stamps, from what both filmed. Pure: images and stamps in, figures out."""
