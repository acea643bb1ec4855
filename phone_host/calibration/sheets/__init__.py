"""Boards and mats as sheets of paper, to scale: what is on them, and how a PDF or an SVG says so."""
