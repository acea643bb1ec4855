"""Which of a host's links carries frames: one is wanted, the board agrees, or it is given up for another. Sans-I/O, `now_ns` passed in.

The board agrees by answering a hello on that link's frames lane. Until then frames come as before.
"""

from collections.abc import Sequence
from typing import Final

from common.protocol.host_path import HostPath
from common.protocol.message import Lane
from common.protocol.session import HELLO_RETRY_NS, MS, LinkDown, Output

STUCK_NS: Final = 1000 * MS
"""A link whose frames lane leaves a hello unanswered for this long gives way to another. This is five hellos."""

SILENCE_BESIDE_NS: Final = 1500 * MS
"""The carrier is lost when it is silent for this long while another link was heard: three accounts and three waves are missing."""

_NEVER: Final = 2**63 - 1


class Carriage:
    """The link that carries frames now, and the link that shall carry them.

    Attributes:
        carrier: the link that carries frames now; None if there is none.
        wanted: the link that shall carry them; None if there is none.
        pending: whether the board has yet to agree to `wanted`.
    """

    def __init__(self, host_id: str, paths: Sequence[HostPath]) -> None:
        self._host_id = host_id
        self._paths = paths
        self.carrier: HostPath | None = None
        self.wanted: HostPath | None = None
        self.pending = False
        self._pending_since_ns = 0
        self._hello_due_ns = 0

    @property
    def due_ns(self) -> int:
        """When `tick` must be called next, host's clock, ns."""
        return self._hello_due_ns if self.pending else _NEVER

    def tick(self, now_ns: int) -> list[Output]:
        """Repeat an unanswered hello for frames."""
        return self._insist(now_ns) if self.pending and now_ns >= self._hello_due_ns else []

    def want(self, path: HostPath, now_ns: int) -> list[Output]:
        """Ask for frames over an open link."""
        self.wanted, self.pending, self._pending_since_ns = path, True, now_ns
        return self._insist(now_ns)

    def want_again(self, now_ns: int) -> list[Output]:
        """Say hello for frames again on the wanted link, if there is one."""
        return [] if self.wanted is None else self.want(self.wanted, now_ns)

    def agree(self, path: HostPath) -> None:
        """Record that the board now sends its frames over this link."""
        self.carrier, self.pending = path, False

    def lose(self, path: HostPath, now_ns: int) -> list[Output]:
        """Record that a link is lost. If frames were wanted there, ask for them on another open link."""
        if self.carrier is path:
            self.carrier = None
        if self.wanted is not path:
            return []
        self.wanted, self.pending = None, False
        following = self.carrier or next((other for other in self._paths if other.is_open), None)
        return [] if following is None else self.want(following, now_ns)

    def end(self) -> None:
        """Record that the board has gone: no link carries frames, and none is wanted."""
        self.carrier = self.wanted = None
        self.pending = False

    def is_silent(self, path: HostPath, now_ns: int) -> bool:
        """Whether a link has been silent for too long. The carrier is given up sooner than other links, because frames must go on."""
        if now_ns - path.heard_ns >= path.silence_ns:
            return True
        return path is self.carrier and any(
            other.is_open and other.heard_ns - path.heard_ns >= SILENCE_BESIDE_NS for other in self._paths
        )

    def absent(self, absent_ns: int, now_ns: int) -> None:
        """Do not count the time in which this process did not run as waiting for an answer."""
        self._pending_since_ns = min(now_ns, self._pending_since_ns + absent_ns)

    def _insist(self, now_ns: int) -> list[Output]:
        """Say hello for frames on the wanted link, or give it up for another."""
        assert self.wanted is not None
        wanted = self.wanted
        others = [path for path in self._paths if path.is_open and path is not wanted]
        if others and now_ns - self._pending_since_ns >= STUCK_NS:
            if self.carrier is wanted:
                self.carrier = None
            after = [path for path in others if path.link > wanted.link]
            return [LinkDown(wanted.link, stuck=True), *self.want(self.carrier or (after or others)[0], now_ns)]
        self._hello_due_ns = now_ns + HELLO_RETRY_NS
        return [*wanted.say_hello(self._host_id, Lane.FRAMES)]
