"""A run in figures, and what may be concluded from them. Pure, except that image motion tracks corners."""
