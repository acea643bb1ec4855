"""Logs each reason not to trust the depth of a run when it appears and when it has gone."""

import logging
from collections.abc import Callable, Iterable
from typing import Final

from common.program.logs import event
from phone_host.measure.trust import Concern, Doubt

_LOG = logging.getLogger(__name__)

_EVERY_NS: Final = 1_000_000_000
"""Nobody acts on a doubt within a second, and judging a run takes time from its pairs."""


class DoubtLog:
    """What was doubted when it last looked.

    Args:
        judge: returns the present concerns.
    """

    def __init__(self, judge: Callable[[], Iterable[Concern]]) -> None:
        self._judge = judge
        self._known: frozenset[Doubt] = frozenset()
        self._due_ns = 0

    def look(self, now_ns: int) -> None:
        """Log what has changed, at most once a second.

        Args:
            now_ns: CLOCK_MONOTONIC, ns.
        """
        if now_ns < self._due_ns:
            return
        self._due_ns = now_ns + _EVERY_NS
        found = {concern.doubt: concern for concern in self._judge()}
        for doubt in found.keys() - self._known:
            concern = found[doubt]
            _LOG.warning(event("depth_doubtful", doubt=doubt.value, problem=concern.sentence, remedy=concern.remedy))
        for doubt in self._known - found.keys():
            _LOG.info(event("depth_trusted", doubt=doubt.value))
        self._known = frozenset(found)
