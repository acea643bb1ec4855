"""What `discovery` and `announced` share: the service that boards announce, and the types of what is found."""

from dataclasses import dataclass
from typing import Final

SERVICE: Final = "_tandemscan._tcp.local."
"""The service that deploy/board/tandemscan.service.xml announces."""

LISTEN_S: Final = 2.5
"""A second query follows after one second, and answers may take up to 120 ms (RFC 6762, sections 5.2 and 6)."""


@dataclass(frozen=True, slots=True)
class Found:
    """A board that answers.

    Attributes:
        name: its name for people; empty if unknown.
        link: its link.
    """

    name: str
    link: str


@dataclass(frozen=True, slots=True)
class Announcement:
    """A service that announces itself on the network.

    Attributes:
        service: its type.
        name: its own, for people.
        host: its address, in brackets where it is one of IPv6.
        port: of TCP.
    """

    service: str
    name: str
    host: str
    port: int
