"""From views of a board to a rig, and from what two cameras see to the difference of their stamps."""
