"""Recordings: MCAP files with ROS 2 messages. How they are written, and read again whatever happened to them."""
