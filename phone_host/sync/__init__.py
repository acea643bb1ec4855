"""One notion of time: clock estimate, pairing, FIFO. Pure cores, `now` passed in."""
