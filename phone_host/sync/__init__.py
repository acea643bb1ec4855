"""One notion of time: clock estimate, pairing and FIFO. Pure cores; `now` is passed in."""
