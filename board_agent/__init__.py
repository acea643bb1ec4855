"""The board's daemon: grabs frames, keeps the newest one and serves it to one host. No numpy, no OpenCV."""
