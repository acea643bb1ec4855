"""What the reception must know of the links that its board may come over."""

from dataclasses import dataclass

from common.protocol.message import Lane


@dataclass(frozen=True, slots=True)
class LinkFacts:
    """What the reception must know of a link.

    Attributes:
        kind: the transport's name.
        dialled: the connections that this side opened, with names unique over all links; empty if the board dials.
        self_paced: whether the link itself holds the next frame back until the previous one has left.
    """

    kind: str
    dialled: dict[Lane, bytes]
    self_paced: bool
