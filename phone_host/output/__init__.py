"""File formats of results: PFM, PLY, PNG. One file each."""
