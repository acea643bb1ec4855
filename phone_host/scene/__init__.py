"""Rendered scenes and films whose depth is known exactly."""
