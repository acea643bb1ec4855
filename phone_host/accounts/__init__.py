"""Figures of delays, links and images: what was measured, never what it means. Pure, except that image motion tracks corners."""
