"""Keeps what a live calibration shows just now, for the page."""

from collections.abc import Callable, Mapping
from typing import Final

from common import now
from phone_host.calibration.guide.guide import View
from phone_host.calibration.guide.picture import guide_svg
from phone_host.calibration.guide.snapshot import GuideSnapshot

_EVERY_NS: Final = 250_000_000


class GuideKeeper:
    """Hands on what guide.json would hold, with the note and the picture, a few times a second.

    Args:
        keep: takes it.
        tell: called when there is something new.
    """

    def __init__(self, keep: Callable[[Mapping[str, object]], None], tell: Callable[[], None]) -> None:
        self._keep, self._tell = keep, tell
        self._due_ns = 0

    def show(self, snapshot: GuideSnapshot, views: tuple[View, ...], note: str) -> None:
        """See Shows."""
        del views
        now_ns = now.monotonic_ns()
        if now_ns < self._due_ns and snapshot.ended.value == "running":
            return
        self._due_ns = now_ns + _EVERY_NS
        self._keep({**snapshot.as_json(), "note": note, "svg": guide_svg(snapshot)})
        self._tell()
