"""The delay benchmark: `delay-bench` runs every interface over sizes, qualities and rates, and predicts settings that were not run."""
