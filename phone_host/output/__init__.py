"""Writers and readers of results: PFM, PLY, PNG, one module per file format."""
