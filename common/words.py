"""Words that all texts share: a number and its noun agree. Pure."""

from collections.abc import Sequence


def counted(count: int, noun: str, plural: str = "") -> str:
    """Write a number with its noun: `1 pair`, `2 pairs`, `0 pairs`.

    Args:
        count: how many.
        noun: the noun for one; may be several words, of which the last one is counted.
        plural: the noun for several; empty: `noun` with an s.
    """
    return f"{count} {noun if count == 1 else plural or noun + 's'}"


def listed(items: Sequence[str], most: int = 8) -> str:
    """Write names one after the other, but not more than fit a line: `a, b and 70 more`."""
    more = f" and {len(items) - most} more" if len(items) > most else ""
    return ", ".join(items[:most]) + more


def times(count: int) -> str:
    """Write how often something happened: `once`, `twice`, `3 times`."""
    return {1: "once", 2: "twice"}.get(count, f"{count} times")


def distance_text(metres: float) -> str:
    """Write a distance with about three digits: `38 m`, `1.25 m`, `300 mm`."""
    return f"{metres * 1000:.3g} mm" if metres < 1.0 else f"{metres:.3g} m" if metres < 1000 else f"{metres:.0f} m"


def two_digits(value: float) -> str:
    """Return a number to two digits, without an exponent: 0.19, 91, 210."""
    return f"{float(f'{value:.2g}'):g}"
