"""Counts everything that came but was not used, by place and reason, in the order of its path. Pure.

All presenters use these counts.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from phone_host.measure.accounts import LinkAccount
from phone_host.measure.run_snapshot import RunSnapshot, disbelieved


@dataclass(frozen=True, slots=True)
class Unused:
    """One place and reason.

    Attributes:
        place: what they are and where they ended, for example `frames dropped on the board`.
        reason: the reason in the words of its account; empty if the place says it.
        count: how many, at least 1.
    """

    place: str
    reason: str
    count: int

    @property
    def words(self) -> str:
        """Place and reason for people."""
        return f"{self.place}: {self._reason_words}" if self.reason else self.place

    @property
    def told(self) -> str:
        """Number, place and reason for people: `1 pair dropped from a full FIFO`."""
        noun, _, rest = self.place.partition(" ")
        if noun in {"board", "host"}:
            second, _, rest = rest.partition(" ")
            noun = f"{noun} {second}"
        if self.count == 1:
            noun, rest = noun.removesuffix("s"), rest.replace("that were not whole images", "that was no whole image")
        reason = f": {self._reason_words}" if self.reason else ""
        return f"{self.count} {noun} {rest}{reason}"

    @property
    def _reason_words(self) -> str:
        """The reason for people: a word of an account gets its spaces; a sentence may hold a name and stays as it is."""
        return self.reason if " " in self.reason else self.reason.replace("_", " ")


def unused(run: RunSnapshot) -> tuple[Unused, ...]:
    """Return what was not used, as far as known. Nothing is counted twice."""
    return tuple(item for item in (*_on_the_way(run), *_on_the_host(run)) if item.count)


def _on_the_way(run: RunSnapshot) -> Iterator[Unused]:
    sessions = run.link.sessions
    for reason, count in board_drops(run.link).items():
        yield Unused("frames dropped on the board", reason, count)
    lost, late = sum(account.lost for account in sessions), sum(account.late for account in sessions)
    yield Unused("frames lost on the link", "", lost - late)
    yield Unused("frames that came too late over another link", "", late)
    yield Unused("frames delivered again", "", sum(account.duplicate for account in sessions))
    yield Unused("frames of an earlier session", "", sum(account.old_session for account in sessions))
    yield Unused("packets of something else", "", run.link.garbage)
    yield Unused("frames that came before the clock was known", "", run.link.no_clock)
    for reason, count in disbelieved(run).items():
        yield Unused("frames with impossible values", reason, count)


def _on_the_host(run: RunSnapshot) -> Iterator[Unused]:
    counts = run.counts
    whole = "were not whole images" if run.camera.origin is None else "could not be used"
    yield Unused(f"host frames that {whole}", "", run.spoiled)
    yield Unused("host frames replaced by newer ones", "", run.skipped)
    for reason, count in counts.board_orphans:
        yield Unused("board frames without partner", reason, count)
    for reason, count in counts.host_orphans:
        yield Unused("host frames without partner", reason, count)
    yield Unused("pairs dropped from a full FIFO", "", counts.dropped)
    for reason, count in run.spoiled_images:
        yield Unused("pairs with a spoiled image", reason, count)
    for trouble, count in run.failed_pairs:
        yield Unused("pairs that could not be processed", trouble.problem, count)
    if run.ended != "running":
        yield Unused("pairs still waiting at the end", "", run.stopped)
    for sink in run.sinks:
        yield Unused("results that came too fast for the sink", sink.name, sink.dropped)
        yield Unused("results that the sink could not write", sink.name, sink.failed)


def board_drops(link: LinkAccount) -> dict[str, int]:
    """Return the frames that the board dropped while this host was connected, by reason."""
    drops: dict[str, int] = {}
    for account in link.sessions:
        before = dict(account.first.dropped)
        for reason, count in account.latest.dropped:
            drops[reason.value] = drops.get(reason.value, 0) + count - before.get(reason, 0)
    return drops
