"""Plots as SVG. Pure: values in, text out."""
