"""What an encoded image says about itself, read before anything is decoded: its kind, its size, whether it can be whole. Pure.

Rules:
- nothing is decompressed, and no header decides how much is allocated; every loop is bounded by the bytes that are there;
- if decoders could read a header in two ways, the image is refused;
- kinds that are not known here are not decoded at all: a decoder that nobody has examined is a security risk.
"""
