"""The arrival of frames: from the board, from the host camera, and where the two meet."""
