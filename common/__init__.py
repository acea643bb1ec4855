"""What both daemons must agree on: stamps, frames, messages, links, cameras. Standard library, pyzmq, msgpack and pyserial only."""
