"""The board's daemon: grabs frames, keeps the newest and serves it to one host. No numpy, no OpenCV."""
