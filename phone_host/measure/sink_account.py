"""The account of a sink of a run. Pure."""

from dataclasses import dataclass

from phone_host.measure.delays import Spread


@dataclass(frozen=True, slots=True, kw_only=True)
class SinkAccount:
    """What became of the results that were handed to one sink.

    Attributes:
        name: name of the sink.
        written: results that it has finished.
        dropped: results that it had no place for.
        failed: results that it took but could not write.
        waiting: results in its queue now.
        delay: time from a result's hand-over until the sink finished it, over all finished results, ns.
    """

    name: str
    written: int
    dropped: int
    failed: int
    waiting: int
    delay: Spread
