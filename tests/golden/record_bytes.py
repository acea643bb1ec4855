"""Records what byte streams carry, based on the transcripts of `record.py`: a serial line, Bluetooth, and the messages of an enrolment.

Run once, against commit aa28bce, after `record.py` and in the same way: `CHECKOUT/.venv/bin/python
tests/golden/record_bytes.py tests/golden/v0_1`.

A step `puts` gives a packet to one end of the stream (lane, header, payload). A step `writes` is what that end then
wrote, at that time; it arrives 2 ms later.
"""

import hashlib
import importlib
import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

from common.protocol.duplex import Duplex
from common.protocol.message import Lane

MS: Final = 1_000_000
START_NS: Final = 40_000_000_000
TRAVEL_NS: Final = 2 * MS
NUMBERS: Final = {"host": 0x600D1234, "board": 0}
"""Numbers of the contacts; a listener's is not used."""

LATER_NS: Final = 300 * MS
"""Packets are sent this much later than in the session: the two ends have to meet first."""


def stream_of(transcript: Path, *, frame_bytes: int) -> list[dict[str, Any]]:
    """What a byte stream carries for a session's messages: the host dials, and says goodbye after the last message."""
    framing: Any = importlib.import_module("common.protocol.framing")
    side = framing.LinkEnd if hasattr(framing, "LinkEnd") else framing.Side  # its name before the hardening
    ends = {
        "host": Duplex(side.DIALLER, NUMBERS["host"], frame_bytes),
        "board": Duplex(side.LISTENER, NUMBERS["board"], frame_bytes),
    }
    steps: list[dict[str, Any]] = []
    under_way: list[tuple[int, str, bytes]] = []
    waiting = packets_of(transcript)
    end_ns = waiting[-1][0] + 400 * MS
    for now_ns in range(START_NS, end_ns, MS):
        while under_way and under_way[0][0] <= now_ns:
            _, who, data = under_way.pop(0)
            ends["board" if who == "host" else "host"].feed(data, now_ns)
        while waiting and waiting[0][0] + LATER_NS <= now_ns:
            _, who, lane, header, payload = waiting[0]
            if not ends[who].put(lane, header, payload):
                break
            steps.append({"who": who, "ns": now_ns, "puts": [lane.name, header.hex(), payload.hex()]})
            waiting.pop(0)
        if now_ns == end_ns - 10 * MS:
            steps.append({"who": "host", "ns": now_ns, "leaves": True})
            ends["host"].leave()
        for who, end in ends.items():
            if data := end.take(now_ns):
                steps.append({"who": who, "ns": now_ns, "writes": data.hex()})
                under_way.append((now_ns + TRAVEL_NS, who, data))
    assert not waiting
    return steps


def packets_of(transcript: Path) -> list[tuple[int, str, Lane, bytes, bytes]]:
    """A session's messages: when (host's clock, to a millisecond), whose, lane, header, payload."""
    head, *steps = map(json.loads, transcript.read_text(encoding="utf-8").splitlines())
    packets = []
    for step in steps:
        at_ns = step["ns"] - (head["offset_ns"] if step["who"] == "board" else 0)
        for connection, header, payload in step["says"]:
            lane = Lane.FRAMES if bytes.fromhex(connection).endswith(b"F") else Lane.CONTROL
            packets.append((at_ns // MS * MS, step["who"], lane, bytes.fromhex(header), bytes.fromhex(payload)))
    return sorted(packets, key=lambda packet: packet[0])


def enrolment(typed: int) -> list[dict[str, Any]]:
    """The messages of an enrolment as they travel; each side's random draws follow from a fixed text."""
    try:
        code = importlib.import_module("common.protocol.enrolment_code")
        wire, words = (importlib.import_module(f"common.protocol.enrolment_{name}") for name in ("wire", "words"))
    except ImportError:  # before the hardening
        code = importlib.import_module("common.protocol.pairing_code")
        wire, words = (importlib.import_module(f"common.protocol.pairing_{name}") for name in ("wire", "words"))
    desk = code.Desk(words.Identity(bytes(range(32)), "board"), chance_of("board"))
    asking = code.Asking(words.Identity(bytes(range(100, 132)), "Téléphone"), chance_of("host"))
    steps: list[dict[str, Any]] = []
    said: Any = asking.ask()
    while said is not None:
        steps.append({"who": "host", "says": wire.frame_word(said).hex()})
        answers = [output.word for output in desk.receive(b"host", said, START_NS) if isinstance(output, code.Say)]
        said = None
        for answer in answers:
            steps.append({"who": "board", "says": wire.frame_word(answer).hex()})
            if isinstance(answer, words.Shown):
                asking.receive(answer)
                said = asking.begin(desk.code(START_NS) ^ typed)
            elif not isinstance(answer, words.Refuse):
                said = asking.receive(answer)
    return [*steps, {"proved": asking.proved}]


def chance_of(who: str) -> Callable[[int], bytes]:
    """Bytes that look random and are always the same."""
    drawn = iter(range(1000))
    return lambda count: hashlib.sha256(f"{who} {next(drawn)}".encode()).digest()[:count]


def main(out: Path) -> None:
    """Record everything."""
    sessions = out / "goodbye_of_the_board.jsonl"
    head = json.loads(sessions.read_text(encoding="utf-8").splitlines()[0])
    of_all = {"commit": head["commit"]}
    recordings = {
        "serial": ({"frame_bytes": 1}, stream_of(sessions, frame_bytes=1)),
        "rfcomm": ({"frame_bytes": 1008}, stream_of(sessions, frame_bytes=1008)),
        "enrolment": ({}, enrolment(0)),
        "enrolment-wrong-code": ({}, enrolment(1)),
    }
    for name, (told, steps) in recordings.items():
        lines = [json.dumps(step, separators=(",", ":")) for step in [of_all | told, *steps]]
        (out / f"{name}.jsonl").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
