"""What `discovery` and `announced` have in common: the service that boards announce, and what is said of one that was found."""

from dataclasses import dataclass
from typing import Final

SERVICE: Final = "_tandemscan._tcp.local."
"""As deploy/board/tandemscan.service.xml announces it."""

LISTEN_S: Final = 2.5
"""A second question follows the first one after a second, and answers are delayed by up to 120 ms (RFC 6762, sections 5.2 and 6)."""


@dataclass(frozen=True, slots=True)
class Found:
    """A board that answers.

    Attributes:
        name: for people; empty where nobody told it.
        link: its link.
    """

    name: str
    link: str
