"""All links of one side as one source of packets.

Rule: a link whose peer turns this side away (a key that it does not know) is done without while there is another, and named once; it dials again by
itself, and a word that comes over it makes it like the others. While all are turned away the last one's refusal is everybody's.
"""

import logging
from collections.abc import Iterator, Sequence

from common.errors import UnavailableError
from common.link.base import Broken, Incoming, Link, Packet
from common.program.logs import event

_LOG = logging.getLogger(__name__)


class SeveralLinks:
    """Receives from links, in their order.

    Args:
        links: open links; closed by their owner.
    """

    def __init__(self, links: Sequence[Link]) -> None:
        self._links = tuple(links)
        self._refused: set[int] = set()

    def receive(self) -> Iterator[tuple[int, Incoming]]:
        """Give all that has come in, without waiting, each with its link's number.

        Raises:
            UnavailableError: every link has been refused.
        """
        for number, link in enumerate(self._links):
            try:
                for incoming in link.receive():
                    if self._refused and isinstance(incoming, Packet):
                        self._refused.discard(number)
                    yield number, incoming
            except UnavailableError as error:
                is_news = number not in self._refused
                self._refused.add(number)
                if len(self._refused) == len(self._links):
                    raise
                if is_news:  # each lane of a link is refused by itself
                    _LOG.warning(event("link_refused", link=link.kind, problem=error.problem, remedy=error.remedy))
                for connection in link.dialled.values():
                    yield number, Broken(connection)
