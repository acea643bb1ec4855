"""The page: a server that renders snapshots and results for any browser. It never reaches into a run."""
