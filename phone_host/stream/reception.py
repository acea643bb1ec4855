"""The host's handling of everything that comes from a board: session, link choice, credit and border.

Believed frames go to a frame sink. This module has no thread, link or clock of its own, so it also runs on simulated
time: messages and `now_ns` come in, and outgoing messages go to `send`.
"""

import logging
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import assert_never

from common.errors import UnavailableError
from common.program.logs import event
from common.protocol import session
from common.protocol.host_session import HostSession
from common.protocol.message import BoardHello, FrameMessage, Locks, LockState, Message, RefusalReason, Rung
from phone_host.accounts.link_account import LinkAccount, LinkTally, SessionAccount, link_names
from phone_host.model import BoardFrame
from phone_host.stream.border import Arrival, Border
from phone_host.stream.frame_sink import FrameSink, LinkFacts
from phone_host.stream.refusals import BoardRefusal, LockAsking, Refusals, refusal_text
from phone_host.sync.choice import LinkChoice
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.flow import Flow

_LOG = logging.getLogger(__name__)


class Reception:
    """The board as this host knows it.

    Attributes:
        account: the links' account so far.
        tail_known: whether the board has told the last account of this session.
        due_ns: when to call `tick` next even if nothing comes, ns; as of the last `tick`.
        hello: the board's description of itself; None before the first contact.

    Args:
        links: the links' facts, the preferred link first.
        host_id: random id of this process.
        sink: takes the frames.
        send: takes outgoing messages.
    """

    def __init__(
        self, links: Sequence[LinkFacts], host_id: str, sink: FrameSink, send: Callable[[session.Outgoing], None]
    ) -> None:
        self._links, self._sink, self._send = tuple(links), sink, send
        self._session = HostSession(host_id, [link.dialled for link in links])
        self._choice = LinkChoice(len(links))
        self._boot_id = ""
        self.hello: BoardHello | None = None
        self._flow = Flow()
        self._streamed_over: int | None = None
        self._refusals = Refusals()
        self._locks = LockAsking()
        self.due_ns = 0
        self._has_news = True
        self._is_choosing = len(links) > 1
        self._is_paced = any(link.self_paced for link in links)
        self.tail_known = False
        self.account = LinkAccount(links=tuple(LinkTally(name) for name in link_names([link.kind for link in links])))
        self._border = Border(self.account, sink.void)

    def refused(self, now_ns: int) -> BoardRefusal | None:
        """Return why the last board heard refuses this host; None if it does not, or is silent now."""
        return self._refusals.last(now_ns)

    @property
    def connected(self) -> bool:
        """Whether a board talks to us now."""
        return self._session.is_open

    @property
    def carrier(self) -> str:
        """Name of the link that carries frames now; empty while there is none."""
        link = self._session.carrier
        return "" if link is None else self.account.links[link].name

    @property
    def locks(self) -> LockState | None:
        """How the board's camera is held, as it said in this session; None: it has not said."""
        return self._locks.state

    @property
    def estimate(self) -> ClockEstimate | None:
        """The clock estimate now; None before the first echo, and while it is in doubt."""
        return self._border.estimate

    @property
    def held(self) -> int:
        """Number of frames that wait for an echo."""
        return self._border.held

    @property
    def ended(self) -> bool:
        """Whether the board's camera has reached the end of its images."""
        return bool(self.account.sessions) and self.account.sessions[-1].ended

    def receive(self, connection: bytes, message: Message, now_ns: int) -> None:
        """Take a message.

        Args:
            connection: where it came from, with a name unique over all links.
            message: the message.
            now_ns: arrival of its last byte, ns.
        """
        if isinstance(message, FrameMessage):
            lost, link = self._session.take_frame(connection[0], message, now_ns), connection[0]
            if isinstance(lost, session.StaleReason):
                self.account.current.count_stale(lost)
            else:
                self._accept_frame(message, lost, link, now_ns)
            return
        self._has_news = True
        self._handle(self._session.receive(connection, message, now_ns), now_ns)

    def refuse_version(self, connection: bytes, theirs: int, now_ns: int) -> None:
        """Take note of a message of another protocol version.

        On a link that is up, it is noise from somebody else. On a connection that this host did not dial, it may come
        from anybody, so it does not count as the board's refusal.
        """
        refusal, link = BoardRefusal(RefusalReason.VERSION, theirs), connection[0]
        if self.account.links[link].is_up:
            self.count_garbage(refusal_text(refusal)[0])
            return
        self.account.garbage += 1
        if not self._session.is_open and connection in self._links[link].dialled.values():
            self._refusals.note(refusal, now_ns)  # the code that waits for the board reports it
        else:
            self._tell_refusal(link, refusal)

    def interrupted(self, connection: bytes, now_ns: int) -> None:
        """Take note that a connection broke."""
        self._has_news = True
        self._handle(self._session.interrupted(connection, now_ns), now_ns)

    def tick(self, now_ns: int) -> None:
        """Do what is due, and grant credit if there is room for frames."""
        if self._has_news or now_ns >= self.due_ns:
            self._attend(now_ns)
        self._sink.tick()
        self._grant(now_ns)

    def _attend(self, now_ns: int) -> None:
        """Do what is due. A frame that passes makes nothing due: it only shows that its link is alive."""
        self._has_news = False
        if self._border.waits_for_echo:
            self._has_news = True
            self._border.tick(now_ns)
            self._session.probe(now_ns)
        if self._locks.is_due(now_ns):
            self._handle(self._session.set_locks(self._locks.wanted), now_ns)
        due_ns = self._session.due_ns
        if now_ns >= due_ns:
            self._handle(self._session.tick(now_ns), now_ns)
            if self._is_choosing and (best := self._choice.best(now_ns)) is not None:
                self._handle(self._session.carry(best, now_ns), now_ns)
            due_ns = self._session.due_ns
        self.due_ns = due_ns

    def steer(self, later_ns: int, now_ns: int) -> None:
        """Ask the board's camera to expose later, by `later_ns` modulo its period. Without a board, do nothing."""
        if self.hello is not None:
            self._handle(self._session.steer(later_ns % self.hello.camera.period_ns), now_ns)

    def hold(self, locks: Locks) -> None:
        """Have the board's camera held like this, in this session and every later one."""
        self._locks.want(locks)
        self._has_news = True

    def slept(self, slept_ns: int, now_ns: int) -> None:
        """Take note that this machine has slept: its clock stood still while the board's and the cameras' went on."""
        self._has_news = True
        self._border.slept(slept_ns)
        self._handle(self._session.begin_clock(now_ns), now_ns)

    def doubt_clock(self, why: str, now_ns: int) -> None:
        """Take note that this machine's clock may have stood still. An echo asked for from now on will tell."""
        self._has_news = True
        self._border.void(why)
        self._handle(self._session.begin_clock(now_ns), now_ns)

    def leave(self, now_ns: int) -> bool:
        """Say goodbye. Return whether a board hears it; it will answer with its last account (`tail_known`)."""
        farewell = self._session.leave()
        self._handle(farewell, now_ns)
        return bool(farewell)

    def close(self) -> None:
        """Take note that nothing more will come."""
        self._border.close()

    def lose_tail(self) -> None:
        """Take note that the last account did not come: what the board sent since the newest account is unknown."""
        self.account.current.vanished = True

    def count_garbage(self, problem: str) -> None:
        """Count something that is not a message of ours."""
        self.account.garbage += 1
        if self.account.garbage.bit_count() == 1:  # log the 1st, 2nd, 4th, 8th …: a hostile peer must not fill the log
            _LOG.warning(event("garbage", count=self.account.garbage, problem=problem))

    def _grant(self, now_ns: int) -> None:
        if self.hello is None:
            return
        if (frames := self._sink.room()) is None:
            round_trip_ns = self._paced_round_trip_ns() if self._is_paced else None
            frames = self._flow.credit(self._session.outstanding, self.hello.camera.period_ns, round_trip_ns)
        else:
            frames -= self._border.held  # they have come, and will be let in together
        if frames > 0 and self._border.takes_frames:  # without a clock, frames could not be paired
            self._handle(self._session.grant(frames), now_ns)

    def _paced_round_trip_ns(self) -> int | None:
        """Round trip of the carrier if it paces itself, ns; 0 before its first echo."""
        carrier = self._session.carrier
        if carrier is None or not self._links[carrier].self_paced:
            return None
        return self._border.round_trip_ns(carrier) or 0

    def _handle(self, outputs: list[session.Output], now_ns: int) -> None:
        """Do what the session says, save for frames: those come by a shorter way, see `receive`."""
        for output in outputs:
            assert not isinstance(output, session.Arrived | session.Stale)
            match output:
                case session.Outgoing():
                    self._send(output)
                case session.Echo() | session.ClockVoid():
                    self._note_clock(output, now_ns)
                case session.Accepted():
                    self._begin(output, now_ns)
                case session.LinkUp() | session.LinkDown() | session.OtherBoard():
                    self._note_link(output, now_ns)
                case session.Counted():
                    self._note_account(output, now_ns)
                case session.LocksTold(state):
                    self._locks.told(state)
                case session.Stepped(rung):
                    self._note_rung(rung)
                case session.Refused() | session.Unbelievable():
                    self._note_refusal(output, now_ns)
                case session.Vanished(orderly):
                    self._note_gone(orderly=orderly, now_ns=now_ns)
                case _:
                    assert_never(output)

    def _note_clock(self, echo: session.Echo | session.ClockVoid, now_ns: int) -> None:
        """Give an echo to the clock and pass the frames that it has proven; or restart the clock if it is void."""
        if isinstance(echo, session.ClockVoid):
            self._border.void("the board had not heard this host for a while")
            return
        for passed in self._border.learn(echo):
            self._pass(*passed)
        self._choice.echo(echo.link, (echo.t3_ns - echo.t0_ns) - (echo.t2_ns - echo.t1_ns), now_ns)

    def _note_account(self, counted: session.Counted, now_ns: int) -> None:
        """Take note of the board's account of the present session."""
        self.tail_known |= counted.last  # an older account may still follow on the other lane
        account = self.account.current
        account.lost += counted.lost
        account.latest = max(counted.counts, account.latest, key=lambda counts: (counts.grabbed, counts.sent))
        account.ended |= counted.ended
        self._choice.account(counted.counts.grabbed, now_ns, has_credit=self._session.outstanding > 0)

    def _note_refusal(self, refused: session.Refused | session.Unbelievable, now_ns: int) -> None:
        """Note that a board refuses this host, or sends nonsense.

        If another link is up, the run goes on, so the refusal is logged once.
        """
        if isinstance(refused, session.Unbelievable):
            self.count_garbage(refused.problem)
            return
        refusal = BoardRefusal(refused.reason)
        self._refusals.note(refusal, now_ns)
        if self._session.is_open:
            self._tell_refusal(refused.link, refusal)

    def _tell_refusal(self, link: int, refusal: BoardRefusal) -> None:
        if self._refusals.is_news(link):
            problem, remedy = refusal_text(refusal)
            _LOG.warning(event("link_refused", link=self.account.links[link].name, problem=problem, remedy=remedy))

    def _note_gone(self, *, orderly: bool, now_ns: int) -> None:
        """Take note that the board has gone from all links."""
        self._border.close()
        self.account.current.vanished = not orderly
        if not self.account.current.ended:
            self.account.board_left(now_ns)
        for number, tally in enumerate(self.account.links):
            self._choice.down(number, now_ns)
            tally.is_up = False
        _LOG.info(event("board_gone", session=self.account.current.session, orderly=orderly))

    def _note_link(self, news: session.LinkUp | session.LinkDown | session.OtherBoard, now_ns: int) -> None:
        """Take note of a link that came up, went down, or leads to a different board."""
        tally = self.account.links[news.link]
        match news:
            case session.LinkUp(link, hello):
                tally.is_up = True
                self._refusals.link_up(link)
                if hello.boot_id != self._boot_id:
                    self._boot_id = hello.boot_id
                    self._border.other_clock()
                self._choice.up(link, now_ns)
                _LOG.info(event("link_up", link=tally.name))
            case session.LinkDown(link, stuck):
                tally.is_up = stuck
                tally.lost += 1
                self._border.link_down(link)
                self._choice.down(link, now_ns)
                if stuck:
                    self._choice.up(link, now_ns)
                _LOG.info(event("link_down", link=tally.name, stuck=stuck))
            case session.OtherBoard(link, hello):
                ours = self.hello
                names = " and ".join(tally.name for tally in self.account.links)
                if tally.frames or tally.lost or ours is None:  # it was right once: somebody has moved a cable
                    _LOG.warning(event("other_board", link=tally.name, camera=hello.camera.name))
                    return
                raise UnavailableError(
                    f"links {names} lead to different boards ({ours.camera.name} and, on link {link + 1}, {hello.camera.name})",
                    "give --link only addresses of the same board",
                )
            case _:
                assert_never(news)

    def _begin(self, accepted: session.Accepted, now_ns: int) -> None:
        hello, link = accepted.hello, accepted.link
        self._refusals.accepted()
        self.hello = hello
        self._flow = Flow()
        self.tail_known = False
        self._choice.carries(link, now_ns)
        self.account.board_came(now_ns)
        tally, before = self.account.links[link], self._streamed_over
        self._streamed_over = link
        if accepted.resumed:
            self.account.current.lost += accepted.lost
            self.account.current.vanished = False
        else:
            self.account.sessions.append(SessionAccount(hello.session, hello.counts, hello.counts))
            self._locks.begin()
            self._sink.begin(hello.camera)
        self.account.current.rung = hello.rung
        self._sink.change_period(hello.camera.period_ns)
        if link != before:
            tally.carried += 1
        if accepted.resumed and before is not None and link != before:
            self.account.switches += 1
            names = self.account.links
            _LOG.info(event("link_switched", source=names[before].name, target=tally.name, lost=accepted.lost))
            return
        self.account.connects += 1
        camera, size = hello.camera.name, f"{hello.camera.width_px}x{hello.camera.height_px}"
        came = {"session": hello.session, "resumed": accepted.resumed, "link": tally.name}
        _LOG.info(event("board_found", **came, camera=camera, size=size))

    def _note_rung(self, rung: Rung) -> None:
        """Adopt the new rung of the board's camera."""
        assert self.hello is not None
        self.hello = replace(self.hello, camera=replace(self.hello.camera, period_ns=rung.period_ns), rung=rung)
        self.account.current.rung = rung
        self._sink.change_period(rung.period_ns)
        fps = round(1e9 / rung.period_ns, 2)
        _LOG.info(event("board_camera_stepped", rung=rung.index, last=rung.last, fps=fps, quality=rung.quality))

    def _accept_frame(self, frame: FrameMessage, lost: int, link: int, now_ns: int) -> None:
        """Count a frame of the present session and give it to the border."""
        account, tally = self.account.sessions[-1], self.account.links[link]
        account.received += 1
        account.lost += lost
        tally.frames += 1
        tally.bytes += len(frame.payload)
        assert self.hello is not None
        arrival = Arrival(frame, link, account, self.hello.camera, now_ns)
        if (believed := self._border.admit(arrival)) is None:
            self._has_news = True
        else:
            self._pass(link, believed)

    def _pass(self, link: int, frame: BoardFrame) -> None:
        """Pass a believed frame to the sink, if the sink wants it."""
        assert self.hello is not None
        if (objection := self._sink.objection(frame)) is not None:
            self.account.current.disbelieved[objection] += 1
            return
        message, marks = frame.message, frame.marks
        transit_ns = frame.received_ns - marks.sent_ns
        if self._is_choosing:
            self._choice.frame(link, transit_ns, frame.received_ns)
        self._flow.arrived(transit_ns, marks.sent_ns - marks.grabbed_ns, self.hello.camera.period_ns, frame.received_ns)
        self.account.links[link].age.add(frame.received_ns - marks.exposed_ns)
        self._border.passed(message)
        self._sink.add_board(frame)
