"""What a camera's images are worth for measuring: rate, stamps, light, and whether its software warps them. Pure."""
