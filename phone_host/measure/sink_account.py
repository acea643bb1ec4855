"""How a sink of a run has fared. Pure."""

from dataclasses import dataclass

from phone_host.measure.delays import Spread


@dataclass(frozen=True, slots=True, kw_only=True)
class SinkAccount:
    """What became of the results that were handed to one sink.

    Attributes:
        name: the sink's.
        written: results that it has done with.
        dropped: results that it had no place for.
        failed: results that it had a place for and could not write.
        waiting: results in its queue now.
        delay: from a result's hand-over to when the sink had done with it, over all of them, ns.
    """

    name: str
    written: int
    dropped: int
    failed: int
    waiting: int
    delay: Spread
