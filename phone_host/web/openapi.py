"""Describes the HTTP API for programs, as OpenAPI 3.1. Pure."""

_Json = dict[str, object]


def description() -> _Json:
    """Return the description."""
    return {}
