"""What a run was, in figures, and what may be claimed of it. Pure, but for the corners that image motion follows."""
