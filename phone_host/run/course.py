"""Follows a run to its end: its number of pairs, its time, the end of a stream, or somebody's wish."""

from collections.abc import Callable
from typing import Final

from common import now
from common.camera.image_numbers import plain_camera
from common.errors import AbsentBoardError, SettingsError
from common.protocol.message import CameraDescription, Pacing
from phone_host.run.host_settings import EndReason, HostSettings
from phone_host.run.ledgerer import Ledgerer
from phone_host.run.pipeline import Worker
from phone_host.stream.await_board import BoardPatience, refusal_error
from phone_host.stream.pair_queue import PairQueue
from phone_host.stream.refusals import BoardRefusal
from phone_host.stream.streams import BoardStream, OwnStream

_STEP_S: Final = 0.05
_FIRST_PAIR_NS: Final = 10_000_000_000
"""A limited run allows this much for the first pair: learning the clock takes a second, the first use of OpenCV another."""

_LAST_PARTNER_NS: Final = 1_000_000_000
"""After one stream has ended, the other gets this long to deliver the last partners."""
_MIXED_REMEDY: Final = (
    "for photographs, leave fps=, loop=, phase_ms= and pace=clock out on both sides; for a film or a live camera, give fps="
    " or loop=1 on the side that shows stills"
)


class Course:
    """The course of one run.

    Attributes:
        refusal: why the board refuses this host, now or at the end; None: it does not, or is silent.

    Args:
        settings: of the run.
        own: the host's camera.
        streams: both sides: the host's camera and the board.
        queue: pairs their frames.
        worker: processes the pairs.
        ledgerer: knows what was processed.
    """

    def __init__(
        self,
        settings: HostSettings,
        own: CameraDescription,
        streams: tuple[OwnStream, BoardStream],
        *,
        queue: PairQueue,
        worker: Worker,
        ledgerer: Ledgerer,
    ) -> None:
        self._settings, self._own = settings, own
        self._camera, self._receiver = streams
        self._queue, self._worker, self._ledgerer = queue, worker, ledgerer
        self._time_limit = TimeLimit(settings.seconds_ns)
        self.refusal: BoardRefusal | None = None

    def follow(
        self,
        stop: Callable[[], bool],
        watch: Callable[[], None] | None,
        step: Callable[[int], None],
        raise_failures: Callable[[], None],
    ) -> EndReason:
        """Follow the run to its end.

        Args:
            stop: called several times a second.
            watch: called as often, for a live view.
            step: called as often with the time, ns.
            raise_failures: raises what a part of the run has failed with.

        Raises:
            UnavailableError: no board came in time, or it does not talk to this host.
            DataError: the streams' images or the cameras do not fit the rig.
            SettingsError: one camera shows stills, the other one a film.
        """
        patience = BoardPatience(self._settings.wait_ns, now.monotonic_ns())
        ending_since_ns: int | None = None
        while not self._worker.finished.wait(_STEP_S):
            now_ns = now.monotonic_ns()
            raise_failures()
            self._check_kinds()
            step(now_ns)
            if watch is not None:
                watch()
            if stop():
                return EndReason.STOPPED
            present = self._receiver.connected or self._receiver.ended
            patience.look(now_ns, None if present else self._receiver.refused, present=present)
            self.refusal = patience.refused
            if self._time_limit.is_over(
                now_ns, has_met_board=self._receiver.hello is not None, begun_ns=self._ledgerer.first_done_ns
            ):
                return self._drain(stop, watch, raise_failures, EndReason.SECONDS_OVER)
            if self._receiver.ended or self._camera.ended:
                ending_since_ns = now_ns if ending_since_ns is None else ending_since_ns
                if self._all_paired() or now_ns - ending_since_ns > _LAST_PARTNER_NS:
                    if self._receiver.ended:
                        self._queue.board_ended()
                    return self._drain(stop, watch, raise_failures, EndReason.STREAM_ENDED)
        raise_failures()
        return EndReason.PAIRS_REACHED

    def _check_kinds(self) -> None:
        """Refuse a board that shows stills beside a camera with a clock, or the reverse.

        Only the first board is a mistake of the user's. Frames of a later one with another kind of camera are refused
        by the pair queue, because a board must not be able to end a run.

        Raises:
            SettingsError: the two kinds are mixed.
            AbsentBoardError: this machine's camera has shown its last image before a board came.
            BusyBoardError: the same, because the board talks to another host.
        """
        hello = self._receiver.hello
        if hello is not None:
            if sum(bool(account.session) for account in tuple(self._receiver.account.sessions)) == 1:
                require_one_kind(self._own, hello.camera)
        elif self._camera.ended:
            if self.refusal is not None:
                raise refusal_error(self.refusal)
            raise AbsentBoardError(
                "no board came before this machine's camera had shown its last image",
                "start board-agent first, or give loop=1 in --camera",
            )

    def _drain(
        self,
        stop: Callable[[], bool],
        watch: Callable[[], None] | None,
        raise_failures: Callable[[], None],
        ended: EndReason,
    ) -> EndReason:
        """Let the worker finish the waiting pairs. No frame will follow."""
        self._queue.finish()
        while not self._worker.has_ended(_STEP_S):
            if watch is not None:
                watch()
            if stop():
                return EndReason.STOPPED
        raise_failures()
        reached = self._settings.pairs and self._ledgerer.processed >= self._settings.pairs
        return EndReason.PAIRS_REACHED if reached else ended

    def _all_paired(self) -> bool:
        counts = self._queue.counts
        return self._receiver.ended and (counts.held_board == 0 or (self._camera.ended and counts.held_host == 0))


def require_one_kind(own: CameraDescription, board: CameraDescription) -> None:
    """Refuse stills on one side beside a camera with a clock on the other: nothing says which images belong together.

    Raises:
        SettingsError: one of the two shows images on demand, the other by its clock.
    """
    if own.pacing is board.pacing:
        return
    names = f"the board's camera {_address(board)}", f"this machine's camera {_address(own)}"
    stills, film = names if board.pacing is Pacing.DEMAND else names[::-1]
    raise SettingsError(f"{stills} shows stills, {film} keeps a clock", _MIXED_REMEDY)


def _address(camera: CameraDescription) -> str:
    """Return what a camera's address begins with, as far as its description tells."""
    kind, space, rest = plain_camera(camera.name).partition(" ")
    return f"{kind}:{rest}" if kind == "replay" and space else camera.name


def patience_s(wait_s: float | None, seconds: float) -> float | None:
    """Return how long to wait for an absent board, s; None: for ever.

    Args:
        wait_s: what was asked for; None: nothing.
        seconds: how long the run may take from its first pair, s; 0: no limit. A limited run must end without a board, too.
    """
    return wait_s if wait_s is not None or not seconds else seconds + _FIRST_PAIR_NS / 1e9


class TimeLimit:
    """Counts a run's time from its first pair.

    Args:
        limit_ns: how long the run may take; 0: no limit.
    """

    def __init__(self, limit_ns: int) -> None:
        self._limit_ns = limit_ns
        self._met_ns = 0

    def is_over(self, now_ns: int, *, has_met_board: bool, begun_ns: int) -> bool:
        """Whether the time has passed since the first pair, or no pair came for long after the board had.

        Args:
            now_ns: CLOCK_MONOTONIC, ns.
            has_met_board: whether a board has said hello.
            begun_ns: when the first pair was done; 0: none yet.
        """
        if not self._met_ns and has_met_board:
            self._met_ns = now_ns
        if not begun_ns and self._met_ns:
            begun_ns = self._met_ns + _FIRST_PAIR_NS
        return bool(self._limit_ns and begun_ns) and now_ns - begun_ns >= self._limit_ns
