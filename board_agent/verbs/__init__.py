"""One module per verb of board-agent: what it does, what it prints, its exit code. Its options are in `cli`."""
