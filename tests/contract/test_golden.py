"""Neighbouring versions: today's two roles replace those that were recorded (tests/golden), message by message.

Where today's role deliberately says something else, the difference is named here, with what the older program makes of it. This was tested live: commit
aa28bce and this version, each as board and as host, over ipc, tcp and a serial line, 50 pairs each, every frame accounted for (decision 0027).
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import msgpack
import pytest

from common.protocol.message import (
    BoardCounts,
    Bye,
    FrameMessage,
    HostHello,
    Knock,
    Lane,
    LockState,
    Message,
    Refusal,
    RefusalReason,
    SetLocks,
    Status,
)
from common.protocol.session import Accepted, Arrived, Counted, Refused, Vanished, connection_name
from common.protocol.wire import decode, encode, encode_for_any_version
from phone_host.model import BoardFrame
from phone_host.stream.frame_sink import LinkFacts, NoFrames
from phone_host.stream.reception import Reception
from phone_host.stream.refusals import BoardRefusal, refusal_text
from tests.golden.record import MS, OFFSET_NS, SLOTS, board_ns
from tests.support.golden import (
    RECORDED,
    SCENES,
    Words,
    all_words,
    read,
    received,
    recorded,
    replay_board,
    replay_host,
    steps_and_ticks,
)

pytestmark = pytest.mark.parametrize("version", RECORDED)


def goodbye_for_account(old: Message, new: Message) -> bool:
    """A host's goodbye is answered by a goodbye with the account, where it used to be a status. A 0.1 host takes either for the last account after the last frame."""
    return isinstance(old, Status) and new == Bye(old.counts)


def named_lane(old: Message, new: Message) -> bool:
    """A knock for a lost frames lane now names that lane; it used to name the control lane. A 0.1 host greets on both lanes, whichever is named."""
    return isinstance(old, Knock) and old.lane is Lane.CONTROL and new == Knock(Lane.FRAMES, old.session)


Difference = Callable[[Message, Message], bool]

BOARD_SAYS_OTHERWISE: dict[str, Sequence[Difference]] = {
    "goodbye_of_the_host": [goodbye_for_account],
    "goodbye_of_the_board": [goodbye_for_account],  # its own goodbye was answered with one
    "the_board_dials": [goodbye_for_account],
    "a_break": [named_lane, goodbye_for_account],
    "busy": [named_lane, named_lane, goodbye_for_account],  # the stranger that was served had no frames lane
    "two_links": [named_lane, named_lane, named_lane, goodbye_for_account],
}

HOST_FORGETS: dict[str, int] = {"a_break": 1, "two_links": 1}
"""In these scenes a 0.1 board loses its frames lane and knocks for the control lane; today's boards knock for that only when they have forgotten the host."""


@pytest.mark.parametrize("scene", SCENES)
def test_todays_board_answers_a_host_of_then_as_the_board_of_then(version: str, scene: str) -> None:
    """The same messages go out at the same times on the same connections, byte for byte, except for the named differences."""
    head, steps = read(version, scene)
    then, today = recorded(steps, "board"), replay_board(head, steps).said
    assert [(words.ns, words.connection) for words in today] == [(words.ns, words.connection) for words in then]
    others = [(old, new) for old, new in zip(then, today, strict=True) if old != new]
    named = BOARD_SAYS_OTHERWISE[scene]
    assert len(others) == len(named)
    for (old, new), is_meant in zip(others, named, strict=True):
        assert is_meant(old.message, new.message), (old, new)


@pytest.mark.parametrize("scene", SCENES)
def test_todays_host_says_to_a_board_of_then_what_the_host_of_then_said(version: str, scene: str) -> None:
    """The same messages at the same times, byte for byte; if the old board seems to have forgotten the host, up to that point.

    Its id ends with a mark that it reads long hellos. An old board takes an id as it comes, and says nothing that is new.
    """
    head, steps = read(version, scene)
    then, today = recorded(steps, "host"), replay_host(head, steps).said
    words = all_words(steps)
    knocks_ns = [
        step["ns"]
        for step in steps
        if scene in HOST_FORGETS
        and step["who"] == "host"
        and "number" in step
        and isinstance(received(step, words), Knock)
    ]
    end_ns = min(knocks_ns, default=2**62)
    assert [unmarked(word) for word in today if word.ns < end_ns] == [word for word in then if word.ns < end_ns]
    assert len(today) > len(then) // 2


def unmarked(word: Words) -> Words:
    """The same words from a host that does not say that it reads long hellos."""
    said = word.message
    if not isinstance(said, HostHello):
        return word
    assert said.reads_long
    assert msgpack.unpackb(word.header)[2] == f"{said.host_id}+long"
    return replace(word, header=encode(replace(said, reads_long=False))[0])


@pytest.mark.parametrize("scene", SCENES)
def test_todays_host_knows_what_became_of_every_frame_of_then(version: str, scene: str) -> None:
    """Each frame that came is taken; each that the board reports and that did not come is lost. Nothing is doubted, and the end is recognised."""
    head, steps = read(version, scene)
    noticed = replay_host(head, steps).noticed
    came = frames_for_host(steps)
    arrived = [event for event in noticed if isinstance(event, Arrived)]
    assert [event.frame for event in arrived] == came
    lost = sum(event.lost for event in noticed if isinstance(event, Arrived | Accepted | Counted))
    counts = [event.counts for event in noticed if isinstance(event, Counted)]
    assert max(account.sent for account in counts) == len(came) + lost
    leaving = scene in {"goodbye_of_the_board", "busy"}
    assert any(event == Vanished(orderly=True) for event in noticed) is leaving
    # A status after the last frame answers a host's goodbye, but may also have been under way before it: it is believed, but not called the last.
    assert [event.last for event in noticed if isinstance(event, Counted)][-1] is leaving
    assert all(event == Refused(RefusalReason.BUSY) for event in noticed if isinstance(event, Refused))


class Frames(NoFrames):
    """A sink that keeps believed frames."""

    def __init__(self) -> None:
        self.taken: list[BoardFrame] = []

    def room(self) -> int:
        """As many frames as the old host allowed."""
        return SLOTS

    def add_board(self, frame: BoardFrame) -> None:
        """Keep a frame."""
        self.taken.append(frame)


@pytest.mark.parametrize(
    "scene", [scene for scene in SCENES if scene != "two_links"]
)  # a reception chooses links itself
def test_the_reception_believes_a_board_of_then(version: str, scene: str) -> None:
    """Every frame passes the border, the clock matches the recording, and the final account is the board's."""
    head, steps = read(version, scene)
    sink = Frames()
    reception = reception_of(head, sink)
    words, estimates = all_words(steps), []
    for step, due_ns in steps_and_ticks(reception, steps, "host"):
        if due_ns is not None:
            reception.tick(due_ns)
            continue
        meet(reception, step, words)
        if reception.estimate is not None:
            estimates.append(reception.estimate)
    came = frames_for_host(steps)
    assert [frame.message.sent_index for frame in sink.taken] == [frame.sent_index for frame in came]
    (account,) = reception.account.sessions
    assert (account.received, account.lost) == (len(came), account.latest.sent - len(came))
    assert (account.disbelieved.total(), account.duplicate, account.late, account.old_session) == (0, 0, 0, 0)
    assert reception.account.garbage == 0
    assert reception.tail_known is (scene in {"goodbye_of_the_board", "busy"})
    assert estimates
    for estimate in estimates:
        # Host's clock minus board's clock, from how the recorder set the board's clock.
        truth_ns = round((estimate.reference_ns - OFFSET_NS) * 50_000 / 50_001) - estimate.reference_ns
        assert estimate.low_ns - 2 <= truth_ns <= estimate.high_ns + 2
        assert abs(estimate.offset_ns - truth_ns) < 2 * MS  # half the difference of the lanes is 1 ms
        assert board_ns(estimate.reference_ns + truth_ns) == pytest.approx(estimate.reference_ns, abs=2)


def reception_of(head: dict[str, Any], sink: NoFrames) -> Reception:
    """A reception over the links of a scene."""
    names = [{lane: connection_name(link, lane.name[:1].encode()) for lane in Lane} for link in range(head["links"])]
    facts = [LinkFacts("tcp", {} if head["board_dials"] else link, self_paced=False) for link in names]
    return Reception(facts, "golden-host", sink, lambda _: None)


def meet(reception: Reception, step: dict[str, Any], words: list[Words]) -> None:
    """Let a reception receive what the old host received; when to allow frames, and over which link, is its own choice."""
    ns = step["ns"]
    match step["do"]:
        case "receive":
            reception.receive(bytes.fromhex(step["connection"]), received(step, words), ns)
            reception.tick(ns)
        case "interrupted":
            reception.interrupted(bytes.fromhex(step["connection"]), ns)
        case "leave":
            reception.leave(ns)
        case _:
            assert step["do"] in {"grant", "carry", "steer"}


def frames_for_host(steps: list[dict[str, Any]]) -> list[FrameMessage]:
    """The frames that arrived at the host."""
    words = all_words(steps)
    came = [received(step, words) for step in steps if step["who"] == "host" and step["do"] == "receive"]
    return [message for message in came if isinstance(message, FrameMessage)]


@pytest.mark.parametrize("scene", SCENES)
def test_equal_messages_have_equal_bytes(version: str, scene: str) -> None:
    """Today's decoder reads every recorded message, and today's encoder reproduces its header byte for byte."""
    words = all_words(read(version, scene)[1])
    assert words
    for word in words:
        header, payload = encode(word.message)
        assert (header, bytes(payload)) == (word.header, word.payload)


def test_the_recordings_hold_every_kind_of_message(version: str) -> None:
    """The recordings cover every message of the protocol, except those that are only said to programs that understand them."""
    kinds = {type(word.message) for scene in SCENES for word in all_words(read(version, scene)[1])}
    assert {*kinds, Refusal, SetLocks, LockState} == set(Message.__args__)


def test_a_refusal_of_a_version_is_said_as_then(version: str) -> None:
    """A refusal comes in the envelope of the version that asked. If it lacks the board's own version, today's host knows that the board is older."""
    (refusals,) = read(version, "refusals")[1]
    for asked, header in refusals.items():
        assert encode_for_any_version(int(asked), Refusal(RefusalReason.VERSION)).hex() == header
    told = decode(bytes.fromhex(refusals["3"]))
    assert told == Refusal(RefusalReason.VERSION)
    assert refusal_text(BoardRefusal(told.reason)) == (
        "the board speaks an older protocol than 3, which this host speaks",
        "update the board's tandemscan",
    )


def test_accounts_never_go_back(version: str) -> None:
    """The counts that today's board sends to an old host only grow, whichever message holds them."""
    for scene in SCENES:
        head, steps = read(version, scene)
        told = [word.message for word in replay_board(head, steps).said]
        counts = [message.counts for message in told if isinstance(message, Status | Bye)]
        assert counts == sorted(counts, key=lambda account: (account.grabbed, account.sent))
        assert counts[-1] != BoardCounts()
