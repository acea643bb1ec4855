"""What an encoded image says of itself, read before anything is decoded: its kind, its size, whether it can be whole. Pure.

Rules:
- nothing is decompressed, nothing is allocated by what a header claims; every loop is bounded by the bytes that are there;
- where a decoder could read a header in two ways, the image is refused;
- kinds that are not known here are not decoded at all: a decoder that nobody has looked at is a door.
"""
