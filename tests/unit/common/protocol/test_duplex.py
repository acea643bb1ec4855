"""Both directions of a line in virtual time: meeting, lanes, the bound on what waits, loss, and hostile bytes."""

import random
import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from common.protocol.chunking import Whole
from common.protocol.duplex import Change, Duplex
from common.protocol.framing import MAX_BODY_BYTES, UNIT_OVERHEAD_BYTES, Deframer, LinkEnd, Unit, UnitKind, unit_parts
from common.protocol.message import Lane
from common.protocol.wire import MAX_HEADER_BYTES, MAX_PAYLOAD_BYTES
from tests.support.virtual_line import VirtualLine

BOARD, HOST = LinkEnd.LISTENER, LinkEnd.DIALLER
S = 1_000_000_000
MS = 1_000_000

RATES = {"115200 8N1": 11_520, "1.5 Mbit/s": 187_500, "gadget": 20_000_000}


def line(bytes_per_s: float = 1e6, delay_ns: int = 300_000, chance: random.Random | None = None) -> VirtualLine:
    """A line whose two ends have met; given a source of chance, it spoils bytes from then on."""
    made = VirtualLine.of(bytes_per_s, delay_ns)
    made.meet()
    if chance is not None:
        for way in made.ways.values():
            way.spoil = lambda data: spoiled(data, chance)
    return made


def spoiled(data: bytes, chance: random.Random) -> bytes:
    """Now and then flip a bit, lose a byte, add noise, or lose all of it."""
    kind = chance.random() * 600
    at = chance.randrange(len(data))
    if kind < 1:
        return data[:at] + bytes((data[at] ^ 1 << chance.randrange(8),)) + data[at + 1 :]
    if kind < 2:
        return data[:at] + data[at + 1 :]
    if kind < 3:
        return data[:at] + chance.randbytes(chance.randrange(40)) + data[at:]
    return b"" if kind < 4 else data


class Film:
    """Sends frames as fast as the line takes them and an echo now and then; notes when."""

    def __init__(self, frame_bytes: int, echo_ns: int = 50 * MS, frames: int = 10**9) -> None:
        self.frame = bytes(frame_bytes)
        self.echo_ns = echo_ns
        self.frames = frames
        self.sent: list[int] = []
        self.pings: dict[bytes, int] = {}
        self.echo_due_ns = 0
        self._seen = 0

    def __call__(self, on: VirtualLine) -> None:
        """Do what is due."""
        board = on.ends[BOARD]
        if len(self.sent) < self.frames and board.ready(Lane.FRAMES):
            assert board.put(Lane.FRAMES, b"%d" % len(self.sent), self.frame)
            self.sent.append(on.now_ns)
        if on.now_ns >= self.echo_due_ns:
            self.echo_due_ns = on.now_ns + self.echo_ns
            name = b"p%d" % len(self.pings)
            self.pings[name] = on.now_ns
            on.ends[HOST].put(Lane.CONTROL, name.ljust(30), b"")
        came = on.came[BOARD]
        for _, event in came[self._seen :]:
            if isinstance(event, Whole):
                board.put(Lane.CONTROL, bytes(event.header), b"")
        self._seen = len(came)

    def round_trips_ns(self, on: VirtualLine, after_ns: int) -> list[int]:
        """How long each echo took."""
        answers = [(at, bytes(event.header).strip()) for at, event in on.came[HOST] if isinstance(event, Whole)]
        return [at - self.pings[name] for at, name in answers if name in self.pings and self.pings[name] > after_ns]


def test_two_ends_meet_whoever_comes_first() -> None:
    """Dialler and listener meet once; nothing is accepted before that."""
    made = VirtualLine.of(1e5, MS)
    assert not made.ends[HOST].put(Lane.CONTROL, b"too early", b"")
    made.meet()
    made.run(made.now_ns + S)
    for side in LinkEnd:
        assert [event for _, event in made.came[side]] == [Change.MET]


PACKETS = st.one_of(
    st.tuples(st.just(Lane.FRAMES), st.binary(max_size=60), st.integers(0, 6000)),
    st.tuples(st.just(Lane.CONTROL), st.binary(max_size=60), st.integers(0, 100)),
)


@given(
    packets=st.lists(PACKETS, max_size=12), rate=st.sampled_from([11_520, 187_500, 10**7]), delay_ms=st.integers(0, 60)
)
@settings(deadline=None, max_examples=30)
def test_packets_come_whole_and_in_order(packets: list[tuple[Lane, bytes, int]], rate: float, delay_ms: int) -> None:
    """On a clean line of any rate and delay each lane's packets come whole and in order, in both directions at once."""
    made = line(rate, delay_ms * MS)
    waiting = {
        side: [(lane, head, random.Random(size).randbytes(size)) for lane, head, size in packets] for side in LinkEnd
    }
    sent = {side: list(queue) for side, queue in waiting.items()}

    def act(on: VirtualLine) -> None:
        for side, queue in waiting.items():
            while queue and on.ends[side].put(*queue[0]):
                queue.pop(0)

    made.run(made.now_ns + S, act)
    while any(waiting.values()):
        made.run(made.now_ns + S, act)
    made.run(made.now_ns + 2 * S)
    for side in LinkEnd:
        came = [(whole.lane, bytes(whole.header), bytes(whole.payload)) for whole in made.packets(side.peer)]
        for lane in Lane:
            assert [one for one in came if one[0] is lane] == [one for one in sent[side] if one[0] is lane]
        assert made.ends[side].counts.garbage_bytes == 0


@pytest.mark.long
@pytest.mark.parametrize(
    ("rate", "delay_ms", "seconds"),
    [
        ("115200 8N1", 0, 25),
        ("115200 8N1", 15, 25),
        ("1.5 Mbit/s", 0, 12),
        ("1.5 Mbit/s", 1, 3),
        ("1.5 Mbit/s", 15, 3),
        ("gadget", 0, 1),
        ("gadget", 1, 1),
    ],
)
def test_a_saturated_line_is_full_and_echoes_do_not_wait(rate: str, delay_ms: int, seconds: int) -> None:
    """While 25 KB frames fill the line, an echo waits at most 10 ms or two chunks of 256 bytes, and the line is never idle.

    The bound: both delays, the echo's own bytes both ways, and what may be written ahead; on a line with a long delay, also what was written at
    one go after it had run empty. A line that is never idle carries everything except the framing of its units and this film's echoes.
    """
    bytes_per_s, delay_ns = RATES[rate], delay_ms * MS
    made = line(bytes_per_s, delay_ns)
    film = Film(25_000)
    settled_ns = made.now_ns + S // 2
    made.run(made.now_ns + seconds * S, film)
    chunk_bytes = 256 + UNIT_OVERHEAD_BYTES
    ahead_ns = max(10 * MS, round(2 * chunk_bytes / bytes_per_s * S))
    own_ns = round(2 * (36 + 3 * UNIT_OVERHEAD_BYTES) / bytes_per_s * S)
    trips = film.round_trips_ns(made, settled_ns)
    assert len(trips) >= 9
    assert max(trips) <= 2 * delay_ns + own_ns + ahead_ns + 2 * MS + (2 * delay_ns if delay_ms > 1 else 0)
    came = [at for at, event in made.came[HOST] if isinstance(event, Whole) and event.lane is Lane.FRAMES]
    came = [at for at in came if at > settled_ns]
    goodput = 25_000 * (len(came) - 1) / (came[-1] - came[0]) * S
    echo_share = 20 * (36 + UNIT_OVERHEAD_BYTES) / bytes_per_s
    assert goodput / bytes_per_s >= 256 / chunk_bytes - echo_share - 0.01


@pytest.mark.long
def test_the_rate_is_learnt() -> None:
    """The measured rate is within a tenth of the line's, both at first and after the line has become slower."""
    made = line(200_000, MS)
    film = Film(25_000)
    made.run(made.now_ns + 3 * S, film)
    assert made.ends[BOARD].bytes_per_s == pytest.approx(200_000, rel=0.1)
    made.ways[BOARD].bytes_per_s = 50_000
    made.run(made.now_ns + 5 * S, film)
    assert made.ends[BOARD].bytes_per_s == pytest.approx(50_000, rel=0.1)


@pytest.mark.long
@pytest.mark.parametrize(
    ("rate", "frame_bytes"), [(187_500, 25_000), pytest.param(1_000_000, 250_000, marks=pytest.mark.slow)]
)
def test_a_reader_that_is_seldom_awake_gets_what_the_line_carries(rate: float, frame_bytes: int) -> None:
    """If the host reads only every 100 ms the line is still filled, and once the host is awake again echoes wait no longer than before."""
    made = line(rate)
    film = Film(frame_bytes)
    made.run(made.now_ns + 2 * S, film)
    made.ways[BOARD].nap_ns = 100 * MS
    made.run(made.now_ns + 8 * S, film)
    before = len(made.packets(HOST))
    made.run(made.now_ns + 4 * S, film)
    frames = [whole for whole in made.packets(HOST)[before:] if whole.lane is Lane.FRAMES]
    assert frame_bytes * len(frames) / 4 >= 0.8 * rate
    made.ways[BOARD].nap_ns = 1
    made.run(made.now_ns + 11 * S, film)  # the least round trip is measured anew every ten seconds
    settled_ns = made.now_ns
    made.run(made.now_ns + 2 * S, film)
    assert max(film.round_trips_ns(made, settled_ns)) < 14 * MS


@pytest.mark.long
@pytest.mark.parametrize("seed", [0, 1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(2, 30))])
def test_a_bad_line_loses_frames_and_alters_none(seed: int) -> None:
    """On a line that flips, loses, inserts and swallows bytes, frames come in order and unaltered, and the stream never stops."""
    chance = random.Random(seed)
    made = line(500_000, MS, chance)
    film = Film(8000)
    made.run(made.now_ns + 6 * S, film)
    frames = [(at, whole) for at, whole in made.came[HOST] if isinstance(whole, Whole) and whole.lane is Lane.FRAMES]
    assert all(bytes(whole.payload) == film.frame for _, whole in frames)
    numbers = [int(bytes(whole.header)) for _, whole in frames]
    assert numbers == sorted(set(numbers))
    assert len(numbers) > 20
    assert frames[-1][0] > made.now_ns - 2 * S
    counts = made.ends[HOST].counts
    assert counts.garbage_bytes > 0
    assert counts.broken > 0


def test_a_lost_chunk_costs_one_frame() -> None:
    """When one unit is swallowed, the frame it belonged to is missing and all others come."""
    made = line(500_000, MS)
    film = Film(8000, echo_ns=10 * S, frames=20)
    eaten = [40]

    def swallow(data: bytes) -> bytes:
        eaten[0] -= 1
        return b"" if eaten[0] == 0 else data

    made.ways[BOARD].spoil = swallow
    made.run(made.now_ns + 3 * S, film)
    frames = [int(bytes(whole.header)) for whole in made.packets(HOST) if whole.lane is Lane.FRAMES]
    assert len(film.sent) == 20
    assert len(frames) == 19
    assert made.ends[HOST].counts.broken == 1


@pytest.mark.many
def test_acknowledgements_that_all_get_lost_do_not_stop_the_stream() -> None:
    """While the way back is dead little is written; once it works again fresh frames are back within a second."""
    made = line(500_000, MS)
    film = Film(8000, echo_ns=10**6 * S)
    made.run(made.now_ns + S, film)
    made.ways[HOST].spoil = lambda _: b""
    made.run(made.now_ns + 200 * MS, film)
    before = len(made.packets(HOST))
    made.run(made.now_ns + 10 * S, film)
    assert len(made.packets(HOST)) - before <= 10
    made.ways[HOST].spoil = bytes
    back_ns = made.now_ns
    made.run(made.now_ns + 5 * S, film)
    later = [at - back_ns for at, event in made.came[HOST] if isinstance(event, Whole) and at > back_ns]
    assert len([at for at in later if at < 4 * S]) > 100


def test_only_a_silence_that_was_listened_to_gives_a_frame_up() -> None:
    """A half-sent frame survives ten seconds in which its own sender slept; after one second of listening in vain it is given up and counted."""
    made = line(500_000, MS)
    board, host = made.ends[BOARD], made.ends[HOST]
    for sleep_ns, step_ns in ((10 * S, 10 * S), (0, 50 * MS)):
        assert board.put(Lane.FRAMES, b"header", bytes(8000))
        first = board.take(made.now_ns)
        made.now_ns += sleep_ns
        second = board.take(made.now_ns)
        assert board.counts.abandoned == 0
        if sleep_ns:
            host.feed(first + second, made.now_ns)
            board.feed(host.take(made.now_ns), made.now_ns)
            made.run(made.now_ns + S)
            assert [bytes(whole.payload) for whole in made.packets(HOST)] == [bytes(8000)]
            continue
        listened_ns = 0
        while not board.counts.abandoned:
            made.now_ns += step_ns
            listened_ns += step_ns
            board.take(made.now_ns)
        assert listened_ns == S


@pytest.mark.long
@pytest.mark.parametrize("restarts", [BOARD, HOST])
def test_a_restarted_end_is_met_anew(restarts: LinkEnd) -> None:
    """When the program at either end is replaced without notice, the other end learns that the first has gone, and packets flow again."""
    made = line(200_000, MS)
    film = Film(8000)
    made.run(made.now_ns + S, film)
    made.ends[restarts] = Duplex(restarts, 99)
    made.came = {side: [] for side in LinkEnd}
    made.run(made.now_ns + S, Film(8000))
    told = [event for _, event in made.came[restarts.peer] if isinstance(event, Change)]
    assert [event for event in told if event is not Change.GARBAGE] == [Change.PARTED, Change.MET]
    frames = [bytes(whole.header) for whole in made.packets(HOST) if whole.lane is Lane.FRAMES]
    first_new = frames.index(b"0")
    assert frames[first_new:] == [b"%d" % i for i in range(len(frames) - first_new)]


def test_goodbye_is_heard() -> None:
    """When an end leaves, the other end gets its last words first and then learns that it has gone."""
    made = line()
    assert made.ends[BOARD].put(Lane.CONTROL, b"last words", b"")
    made.write()
    made.ends[BOARD].leave()
    made.run(made.now_ns + 50 * MS)
    events = [event for _, event in made.came[HOST]]
    assert isinstance(events[1], Whole)
    assert events[2] is Change.PARTED


def test_an_echoing_line_does_no_harm() -> None:
    """When the other end only returns what it gets (a getty before raw mode), the ends do not meet and nothing is delivered."""
    for side in LinkEnd:
        end = Duplex(side, 5)
        events = []
        for step in range(100):
            data = end.take(step * 50 * MS)
            events += end.feed(data, step * 50 * MS) if data else []
        assert not end.is_up
        assert set(events) <= {Change.GARBAGE}


def test_hostile_units_neither_fill_memory_nor_raise() -> None:
    """Sound units with senseless contents (lengths, numbers, flags, words) deliver nothing beyond the limits and raise nothing."""
    chance = random.Random(4)
    made = line()
    end = made.ends[HOST]
    for number in range(20_000):
        kind = chance.choice(list(UnitKind))
        body = chance.randbytes(chance.choice([0, 1, 5, 6, 30, 300]))
        unit = Unit(
            kind=kind,
            first=chance.random() < 0.5,
            last=chance.random() < 0.5,
            number=chance.choice([number % 65536, 3]),
            body=body,
        )
        for event in end.feed(b"".join(unit_parts(BOARD, unit)), made.now_ns):
            if isinstance(event, Whole):
                assert len(event.header) <= MAX_HEADER_BYTES
                assert len(event.payload) <= MAX_BODY_BYTES < MAX_PAYLOAD_BYTES
        end.take(made.now_ns)


def test_a_peer_that_talks_and_never_reads_is_not_answered_for_ever() -> None:
    """However often the host says OPEN and CLOSE and talks as a stranger while the line takes nothing, only a few words wait; the newest answer is among them."""
    end = Duplex(BOARD, 5)
    for number in range(10_000):
        for unit in (
            _word(0, number),
            _word(3, number),
            Unit(kind=UnitKind.CONTROL, first=True, last=True, number=0, body=b"?"),
        ):  # OPEN, CLOSE
            end.feed(b"".join(unit_parts(HOST, unit)), number * S)
    said = [bytes(unit.body) for unit in Deframer(BOARD).feed(end.take(10_000 * S))]
    assert len(said) <= 4
    assert bytes(_word(1, 9_999).body) in said  # ACCEPT


def _word(value: int, number: int) -> Unit:
    """A contact unit, by its word's number on the wire."""
    return Unit(kind=UnitKind.CONTACT, first=True, last=True, number=0, body=struct.pack("<BI", value, number))


@pytest.mark.parametrize("lost_by", [BOARD, HOST])
def test_a_line_that_was_lost_is_met_anew(lost_by: LinkEnd) -> None:
    """An end whose line was interrupted keeps its counts and must be met again under another number; then packets flow as before."""
    made = line()
    film = Film(2000)
    made.run(made.now_ns + 100 * MS, film)
    end = made.ends[lost_by]
    number, before = end.number, len(made.packets(HOST))
    assert end.interrupt()
    assert not end.is_up
    assert end.due_ns == 0 or lost_by is HOST
    assert not end.interrupt()
    made.meet()
    made.run(made.now_ns + S, Film(2000))
    assert made.ends[HOST].number == made.ends[BOARD].number != number
    assert len(made.packets(HOST)) > before


def test_a_goodbye_before_the_meeting_says_nothing() -> None:
    """An end that leaves before the two have met has nobody to tell."""
    end = Duplex(BOARD, 5)
    end.leave()
    assert end.take(S) == Duplex(BOARD, 5).take(S)
    assert (end.number, end.is_up) == (0, False)


@pytest.mark.parametrize("body", [b"", b"\x00", bytes(6), struct.pack("<BI", 9, 1)])
def test_a_word_that_is_none_changes_nothing(body: bytes) -> None:
    """A contact unit of the wrong length, or with an unknown word, makes the ends neither meet nor part."""
    made = line()
    unit = Unit(kind=UnitKind.CONTACT, first=True, last=True, number=0, body=body)
    for side in LinkEnd:
        assert made.ends[side].feed(b"".join(unit_parts(side.peer, unit)), made.now_ns) == []
        assert made.ends[side].is_up
