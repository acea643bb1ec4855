"""Logging for shells: key=value to stderr, one line for each change of state, none per frame above DEBUG."""

import logging
import sys


def set_up(level: int = logging.INFO) -> None:
    """Send this process's log to stderr. journald and terminals add whatever else they need."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(logging.Formatter("%(asctime)s %(levelname)s %(name)s %(message)s"))
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(level)


def event(name: str, **fields: object) -> str:
    """Format one change of state as `name key=value …`; values with blanks are quoted."""
    return " ".join([name, *(f"{key}={_value(value)}" for key, value in fields.items())])


def _value(value: object) -> str:
    text = str(value).replace("\n", " ")
    return repr(text) if " " in text or not text else text
