"""One link as the host sees it: whether the board answers on it, with which session, and its clock waves. Sans-I/O, `now_ns` passed in."""

from typing import Final

from common.protocol.message import BoardHello, HostHello, Knock, Lane
from common.protocol.session import HELLO_RETRY_NS, MS, SILENCE_NS, TAKEOVER_NS, Outgoing
from common.protocol.waves import Waves

MOST_SILENCE_NS: Final = 30_000 * MS
"""The longest silence tolerated on a link where frames are known to take long."""


class HostPath:
    """The state of one link.

    Args:
        link: its number.
        dialled: the connections that this side opened; empty when the board dials, whose knocks then reveal them.
    """

    def __init__(self, link: int, dialled: dict[Lane, bytes]) -> None:
        self.link = link
        self.dialled = dict(dialled)
        self.lanes = dict(dialled)
        self.waves = Waves(link)
        self.hello: BoardHello | None = None
        self.session = ""
        self.opened_ns = 0
        self.heard_ns = 0
        self.foreign_since_ns: int | None = None
        self.silence_ns = SILENCE_NS
        self._hello_due_ns = 0

    @property
    def is_open(self) -> bool:
        """Whether our board answers here."""
        return self.hello is not None

    @property
    def due_ns(self) -> int:
        """When the session must next act for this link, ns."""
        return self._hello_due_ns if self.hello is None else min(self.waves.due_ns, self.heard_ns + self.silence_ns)

    def is_alive_beside(self, hello: BoardHello, now_ns: int) -> bool:
        """Whether the board on this link is still alive, although another life of a board has said this hello on another link.

        A new life on the same boot means that the old one died, unless it was heard recently. A boot takes longer than the tolerated silence.
        """
        same_boot = self.hello is not None and self.hello.boot_id == hello.boot_id
        return not same_boot or now_ns - self.heard_ns < TAKEOVER_NS

    def lane_of(self, connection: bytes, knock: Knock, now_ns: int) -> Lane | None:
        """Return the lane that a knock speaks for. A board that dials names it itself.

        Args:
            connection: where it came from.
            knock: what came.
            now_ns: host's clock, ns.

        Returns:
            The lane; None if a second board knocks while the first is alive.
        """
        lane = next((lane for lane, known in self.lanes.items() if known == connection), None)
        if lane is None:  # a board that dials
            if self.is_open and knock.session != self.session and now_ns - self.heard_ns < TAKEOVER_NS:
                return None
            lane = knock.lane
            self.lanes[lane] = connection
        elif lane is Lane.FRAMES and knock.lane is Lane.CONTROL and not self.dialled:
            # This connection had been taken for the frames lane.
            del self.lanes[lane]
            lane = Lane.CONTROL
            self.lanes[lane] = connection
        return lane

    def open(self, hello: BoardHello, now_ns: int) -> None:
        """Record that our board answers."""
        self.hello = hello
        self.foreign_since_ns = None
        self.opened_ns = self.heard_ns = now_ns
        self.waves.open(now_ns)

    def lived(self, now_ns: int) -> None:
        """Record a frame that came after the link was given up as silent. On a slow link, everything else waits behind a frame."""
        self.silence_ns = min(MOST_SILENCE_NS, max(self.silence_ns, 2 * (now_ns - self.heard_ns)))

    def shut(self, hello_due_ns: int) -> None:
        """Record that the board is no longer there. It is greeted again from `hello_due_ns` on."""
        self.hello = None
        self._hello_due_ns = hello_due_ns

    def greet(self, host_id: str, now_ns: int) -> list[Outgoing]:
        """Say hello on the control lane, if one is due."""
        if self.hello is not None or now_ns < self._hello_due_ns:
            return []
        self._hello_due_ns = now_ns + HELLO_RETRY_NS
        return self.say_hello(host_id, Lane.CONTROL)

    def say_hello(self, host_id: str, lane: Lane) -> list[Outgoing]:
        """Say hello on a lane, if its connection is known."""
        return [Outgoing(self.lanes[lane], HostHello(host_id, lane, reads_long=True))] if lane in self.lanes else []
