"""A host outside the guest that pairs its own images with the board's, and the proof that each pair is correct."""

import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from tests.support.numbered import BITS, draw, saved_numbers
from tests.support.planes import Plane, plane
from tests.support.programs import PATIENCE_S, Program, host, ledgers, lines
from tests.vm.guest import Guest

FPS: Final = 10
FRAMES: Final = 600
"""A minute of numbered images: a number identifies one moment of it."""

SLACK_S: Final = 0.01
"""Margin for the guest's clock as the host knows it, and for rounding: a tenth of a period."""

NUMBER_ROWS: Final = 12
_NUMBER_COLUMNS: Final = 12 * BITS

_DELAYS: Final = ("capture_ns", "outbox_ns", "propagation_ns", "pairing_ns", "queuing_ns", "processing_ns")

Skew = Callable[[int, int], float]
"""Maps the image numbers of a pair (left, right) to the shortest time that can have been between their stamps, s."""


def webcam_skew(
    late_ns: Mapping[int, tuple[int, int]], right_late_ns: Mapping[int, tuple[int, int]] | None = None
) -> Skew:
    """Time skew of the webcam and a replay on this machine: image k of both is due at k / FPS, and the board stamps it a little later.

    Args:
        late_ns: by image number, least and greatest lateness; read anew for each pair, since it grows while the webcam runs.
        right_late_ns: the same for the right view if that is a webcam's, too; None: a replay is never late.
    """
    lap_s = FRAMES / FPS

    def skew(left: int, right: int) -> float:
        due_s = ((left - right) / FPS + lap_s / 2) % lap_s - lap_s / 2
        right_least_ns, right_most_ns = (0, 0) if right_late_ns is None else right_late_ns[right]
        least_s = due_s + (late_ns[left][0] - right_most_ns) / 1e9
        most_s = due_s + (late_ns[left][1] - right_least_ns) / 1e9
        return 0.0 if least_s <= 0 <= most_s else min(least_s, most_s, key=abs)

    return skew


@dataclass(frozen=True, slots=True)
class Film:
    """What the two cameras see: the same plane, each image with its number in the top rows.

    Attributes:
        left, right: folders of JPEGs, 320x240.
        truth: the plane.
    """

    left: Path
    right: Path
    truth: Plane

    @property
    def frames(self) -> list[bytes]:
        """The left images in order."""
        return [(self.left / f"{number}.jpg").read_bytes() for number in range(FRAMES)]


def write_film(folder: Path) -> Film:
    """Write a minute of both views."""
    truth = plane(width_px=320, height_px=240, shortest_px=6.0)
    for side in ("left", "right"):
        (folder / side).mkdir(parents=True)
        for number in range(FRAMES):
            image = np.array(getattr(truth.pair, side))
            image[:NUMBER_ROWS, :_NUMBER_COLUMNS] = draw(number)[:NUMBER_ROWS, :_NUMBER_COLUMNS]
            done, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, 85])
            assert done
            (folder / side / f"{number}.jpg").write_bytes(jpeg.tobytes())
    return Film(folder / "left", folder / "right", truth)


@dataclass(frozen=True, slots=True)
class Stream:
    """A running host.

    Attributes:
        receiver: its process.
        out: its folder of results.
    """

    receiver: Program
    out: Path

    @property
    def pairs(self) -> int:
        """Pairs so far."""
        return lines(self.out / "delays.jsonl")

    def more(self, pairs: int, when: str) -> None:
        """Wait for this many further pairs."""
        wanted = self.pairs + pairs
        self.until(lambda: self.pairs >= wanted, f"{pairs} pairs {when}")

    def until_said(self, words: str, what: str, times: int = 1, patience_s: float = PATIENCE_S) -> None:
        """Wait until the host has said this so often."""
        self.until(lambda: self.receiver.stderr.count(words) >= times, what, patience_s)

    def until(self, condition: Callable[[], bool], what: str, patience_s: float = PATIENCE_S) -> None:
        """Wait for a condition; after a minute, or when the host has ended, fail with what the host says."""
        deadline = time.monotonic() + patience_s
        while not condition():
            assert self.receiver.process.poll() is None, f"the host has ended: {self.receiver.stderr[-2000:]}"
            late = f"not within {patience_s:.0f} s: {what}; the host says: {self.receiver.stderr[-2000:]}"
            assert time.monotonic() < deadline, late
            time.sleep(0.05)

    def finish(self, skew: Skew) -> dict[str, Any]:
        """Stop the host and check every pair, every delay and every count.

        Args:
            skew: the true time skew.

        Returns:
            The host's report.
        """
        assert self.receiver.stop() == 0, self.receiver.stderr
        assert "Traceback" not in self.receiver.stderr
        check_pairs(self.out, skew)
        check_delays(self.out)
        report: dict[str, Any] = self.receiver.json()
        check_counts(report)
        return report


@contextmanager
def streaming(
    guest: Guest, right: Path, out: Path, arguments: tuple[str, ...] = (), link: str = ""
) -> Iterator[Stream]:
    """Run a host against the guest's board for the length of a block; every pair is saved. The default link is the guest's network."""
    camera = f"replay:{right}?fps={FPS}&loop=1"
    command = [
        "run",
        "--camera",
        camera,
        "--link",
        link or guest.link,
        "--out",
        str(out),
        "--save-every",
        "1",
        "--json",
    ]
    out.parent.mkdir(parents=True, exist_ok=True)
    with host([*command, "--log-level", "info", *arguments], out.parent, f"{out.name}-host") as receiver:
        yield Stream(receiver, out)


def check_pairs(out: Path, skew: Skew) -> None:
    """The images of every pair were exposed within half a period of each other, by ground truth and not by the product's own stamps."""
    numbers = saved_numbers(out)
    assert numbers
    wrong = [
        (left, right, skew(left, right)) for left, right in numbers if abs(skew(left, right)) > 0.5 / FPS + SLACK_S
    ]
    assert not wrong, f"{len(wrong)} of {len(numbers)} pairs are wrong: {wrong[:10]}"


def check_delays(out: Path) -> None:
    """No delay is negative, and the delays add up to the end-to-end delay to the nanosecond."""
    for ledger in ledgers(out):
        assert sum(ledger[name] for name in _DELAYS) == ledger["end_to_end_ns"]
        # The propagation delay is measured across two clocks: it may be too small by their uncertainty, but no more.
        assert ledger["propagation_ns"] > -ledger["uncertainty_ns"], ledger
        assert all(ledger[name] >= 0 for name in _DELAYS if name != "propagation_ns"), ledger


def check_counts(report: dict[str, Any]) -> None:
    """Grabbed frames were sent or dropped, sent ones received or lost, received ones paired, orphaned or held."""
    frames = report["frames"]
    assert frames["received"] == frames["paired"] + frames["held"] + sum(frames["orphaned"].values()), frames
    for session in report["sessions"]:
        assert session["grabbed"] == session["sent"] + sum(session["dropped"].values()) + session["waiting"], session
        if session["tail"] == "known":  # otherwise frames may have come after the last account that arrived
            assert session["sent"] == session["received"] + session["lost"], session


def board_accounts(journal: str) -> dict[str, dict[str, int]]:
    """Accounts of ended sessions in the journal, by session: grabbed, sent, spoiled, dropped (over all reasons)."""
    accounts = {}
    for line in journal.splitlines():
        _, stopped, told = line.partition(" stopped session=")
        if stopped:
            session, *fields = told.split()
            counts = {
                key: int(count) for key, _, count in (field.partition("=") for field in fields) if count.isdigit()
            }
            dropped = sum(count for key, count in counts.items() if key.startswith("dropped_"))
            spoiled = counts.get("dropped_spoiled", 0)
            accounts[session] = {
                "grabbed": counts["grabbed"],
                "sent": counts["sent"],
                "spoiled": spoiled,
                "dropped": dropped,
            }
    return accounts


def kill(stream: Stream) -> None:
    """Kill the host, as in a crash."""
    stream.receiver.send(signal.SIGKILL)
    stream.receiver.wait()


def check_journal(guest: Guest) -> None:
    """The service is up, each session it has closed balances to the frame, and there was never a traceback."""
    guest.until("ActiveState", "active", "the service is up")
    journal = guest.journal()
    assert "Traceback" not in journal
    for session, account in board_accounts(journal).items():
        assert account["grabbed"] == account["sent"] + account["dropped"], session
