"""One module for each verb of board-agent: what it does, what it prints, its exit code. Its options stand in `cli`."""
