"""Which browser it is, by what it says of itself (RFC 9110, section 10.1.5: User-Agent). Pure."""

import re
from typing import Final

_NAMES: Final = (
    # The first that fits: Edge and Samsung's browser call themselves Chrome, too, and Chrome calls itself Safari.
    ("Edge", re.compile(r"Edg(?:A|iOS)?/(\d{1,4})")),
    ("Samsung Internet", re.compile(r"SamsungBrowser/(\d{1,4})")),
    ("Opera", re.compile(r"OPR/(\d{1,4})")),
    ("Firefox", re.compile(r"(?:Firefox|FxiOS)/(\d{1,4})")),
    ("Chrome", re.compile(r"(?:Chrome|CriOS)/(\d{1,4})")),
    ("Safari", re.compile(r"Version/(\d{1,4})\S* (?:Mobile/\S+ )?Safari/")),
)
_SYSTEMS: Final = (
    ("Android", "Android"),
    ("iPhone", "iPhone"),
    ("iPad", "iPad"),
    ("Windows", "Windows"),
    ("Macintosh", "macOS"),
    ("CrOS", "ChromeOS"),
    ("Linux", "Linux"),
)


def browser_name(agent: str) -> str:
    """Return a browser's name, its main version and its system, such as "Chrome 141 on Android".

    Browsers no longer tell the system's version nor the phone's name.

    Args:
        agent: its User-Agent.

    Returns:
        What is known of it; empty: nothing.
    """
    found = ((name, pattern.search(agent)) for name, pattern in _NAMES)
    browser = next((f"{name} {match[1]}" for name, match in found if match is not None), "")
    system = next((name for word, name in _SYSTEMS if word in agent), "")
    return f"{browser} on {system}" if browser and system else browser or system
