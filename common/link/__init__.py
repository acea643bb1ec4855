"""Packet pipes: one class for each kind of transport, all with the same behaviour."""
