"""The delay benchmark: `delay-bench` runs every interface over sizes, qualities and rates, and foretells what was not run."""
