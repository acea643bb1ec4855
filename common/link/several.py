"""All links of one side as one source of packets.

Rule: a link may be refused because its peer does not know this side's key. If another link remains, the session goes on without the refused
one, which is reported once. It redials by itself, and once a packet comes over it, it counts again like the others. If all links are
refused, the last refusal is raised for all of them.
"""

import logging
from collections.abc import Iterator, Sequence

from common.errors import UnavailableError
from common.link.base import Broken, Incoming, Link, Packet
from common.program.logs import event

_LOG = logging.getLogger(__name__)


class SeveralLinks:
    """Receives from several links, in their order.

    Args:
        links: open links; closed by their owner.
    """

    def __init__(self, links: Sequence[Link]) -> None:
        self._links = tuple(links)
        self._refused: set[int] = set()

    def receive(self) -> Iterator[tuple[int, Incoming]]:
        """Return everything that has arrived, without waiting, each item with its link's number.

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
                if is_news:  # each lane of a link is refused separately
                    _LOG.warning(event("link_refused", link=link.kind, problem=error.problem, remedy=error.remedy))
                for connection in link.dialled.values():
                    yield number, Broken(connection)
