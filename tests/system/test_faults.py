"""Bad input, bad peers and full disks: one clear line, the right exit code, nothing lost."""

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import cv2
import msgpack
import pytest
import zmq

from common.versions import PROTOCOL_VERSION
from tests.support.numbered import draw, saved_numbers, write_film
from tests.support.programs import Program, board, free_port, host, ledgers, lines, until

_LOG_LINE = re.compile(r"\d{4}-\d\d-\d\d [\d:,]+ (DEBUG|INFO|WARNING|ERROR) ")
_NO_DEPTH = "phone-host: no --calibration and not --rectified: "


def complaint(running: Program) -> str:
    """The one line that a failed program prints beside its log and the note that it computes no depth."""
    said = [
        line for line in running.stderr.splitlines() if not _LOG_LINE.match(line) and not line.startswith(_NO_DEPTH)
    ]
    assert len(said) == 1, running.stderr
    assert re.match(r"(board-agent|phone-host)( run)?: error: ", said[0]), running.stderr
    return said[0]


def _receiving(film: Path, link: str, out: Path) -> list[str]:
    """A run that saves every pair of a board and a looped film."""
    camera = ["--camera", f"replay:{film}?fps=20&loop=1"]
    return ["run", *camera, "--link", link, "--out", str(out), "--save-every", "1", "--json"]


def test_spoiled_jpegs_are_dropped_on_the_board_and_counted_with_their_reason(tmp_path: Path) -> None:
    """Of 40 images every fourth is truncated: 30 are sent and paired, 10 are counted as spoiled, no pair mixes two moments."""
    left = write_film(tmp_path / "left", 40, spoil_every=4)
    right = write_film(tmp_path / "right", 40)
    link, out = f"ipc://{tmp_path}/link", tmp_path / "out"
    receiving = _receiving(right, link, out)
    with board(["run", "--camera", f"replay:{left}?fps=20&loop=1", "--link", link, "--json"], tmp_path) as sender:
        with host([*receiving, "--fifo", "8", "--pairs", "60"], tmp_path) as receiver:
            assert receiver.wait() == 0
        assert sender.stop() == 0
    numbers = saved_numbers(out)
    assert len(numbers) == 60
    assert all(a == b and a % 4 != 3 for a, b in numbers)
    account = sender.json()
    assert account["dropped"]["spoiled"] >= 60 // 3 - 1
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())
    assert receiver.json()["host_frames"]["orphaned"]["no_partner"] >= 60 // 3 - 1


def test_images_spoiled_on_the_host_cost_only_their_own_pairs(tmp_path: Path) -> None:
    """If the host camera's images are truncated, every fourth board frame finds no partner; the others are paired correctly."""
    left = write_film(tmp_path / "left", 40)
    right = write_film(tmp_path / "right", 40, spoil_every=4)
    link, out = f"ipc://{tmp_path}/link", tmp_path / "out"
    receiving = _receiving(right, link, out)
    sending = ["run", "--camera", f"replay:{left}?fps=20&loop=1", "--link", link]
    with board(sending, tmp_path), host([*receiving, "--fifo", "8", "--pairs", "30"], tmp_path) as receiver:
        assert receiver.wait() == 0
    assert all(a == b and a % 4 != 3 for a, b in saved_numbers(out))
    report = receiver.json()
    assert report["host_frames"]["spoiled"] >= 9
    [session] = report["sessions"]
    never_came = sum(session["dropped"].values()) + session["lost"]  # a busy machine's; they need no partner
    assert 0 < 9 - never_came <= report["frames"]["orphaned"]["no_partner"]


VERSIONS = pytest.mark.parametrize(
    ("theirs", "board_is_older"), [(PROTOCOL_VERSION - 1, True), (PROTOCOL_VERSION + 1, False), (99, False)]
)
"""Protocol versions of a peer, and whether a board of that version is the side to update."""


@VERSIONS
def test_a_host_of_another_version_is_refused_in_its_own_words(
    theirs: int, *, board_is_older: bool, tmp_path: Path
) -> None:
    """Its hello is answered in an envelope of its version, the board's log says in one line which side to update, and the board goes on serving."""
    film, link = write_film(tmp_path / "film", 5), f"ipc://{tmp_path}/link"
    with board(["run", "--camera", f"replay:{film}?loop=1", "--link", link], tmp_path) as sender:
        context = zmq.Context()
        stranger = context.socket(zmq.DEALER)
        stranger.connect(link)
        stranger.send(msgpack.packb([theirs, 0, "another", 0]))
        assert stranger.poll(60_000)
        told = [msgpack.unpackb(stranger.recv()) for _ in range(2)]
        context.destroy(linger=0)
        # A Refusal because of the version comes twice: in the board's envelope, which states that version, and in the stranger's, which it can read.
        assert told == [[PROTOCOL_VERSION, 3, 1], [theirs, 3, 1]]
        with host(["run", "--camera", f"replay:{film}?loop=1", "--link", link, "--pairs", "2"], tmp_path) as receiver:
            assert receiver.wait() == 0
        (line,) = [line for line in sender.stderr.splitlines() if "protocol" in line]
        assert f"the host speaks protocol {theirs}, this board protocol {PROTOCOL_VERSION}" in line
        assert f"update {'the host' if board_is_older else 'this board'}'s tandemscan" in line


@VERSIONS
def test_a_board_of_another_version_ends_the_host_with_one_line(
    theirs: int, *, board_is_older: bool, tmp_path: Path
) -> None:
    """The host ends with exit 3, and its only line says which side must be updated."""
    film, link = write_film(tmp_path / "film", 5), f"ipc://{tmp_path}/link"
    context = zmq.Context()
    other = context.socket(zmq.ROUTER)
    other.bind(link)
    with host(["run", "--camera", f"replay:{film}?loop=1", "--link", link], tmp_path) as receiver:
        assert other.poll(60_000)
        caller, hello = other.recv_multipart()
        assert msgpack.unpackb(hello)[0] == PROTOCOL_VERSION
        for header in ([theirs, 3, 1], [PROTOCOL_VERSION, 3, 1]):  # as board-agent refuses
            other.send_multipart([caller, msgpack.packb(header)])
        assert receiver.wait() == 3
        (line,) = [line for line in receiver.stderr.splitlines() if "protocol" in line]
        assert f"the board speaks protocol {theirs}, this host protocol {PROTOCOL_VERSION}" in line
        assert f"update {'the board' if board_is_older else 'this host'}'s tandemscan" in line
    context.destroy(linger=0)


def test_a_board_that_does_not_tell_its_version_is_the_older_one(tmp_path: Path) -> None:
    """Boards of 0.1 refuse only in the host's version: the host says that the board must be updated."""
    film, link = write_film(tmp_path / "film", 5), f"ipc://{tmp_path}/link"
    context = zmq.Context()
    other = context.socket(zmq.ROUTER)
    other.bind(link)
    with host(["run", "--camera", f"replay:{film}?loop=1", "--link", link], tmp_path) as receiver:
        assert other.poll(60_000)
        other.send_multipart([other.recv_multipart()[0], msgpack.packb([PROTOCOL_VERSION, 3, 1])])
        assert receiver.wait() == 3
        assert "update the board's tandemscan" in complaint(receiver)
    context.destroy(linger=0)


def bad_folders(root: Path) -> dict[str, tuple[Path, int, str]]:
    """Invalid replay folders: path, exit code, what the message names."""
    empty = root / "empty"
    empty.mkdir()
    mixed = write_film(root / "mixed", 3)
    cv2.imwrite(str(mixed / "7.jpg"), cv2.resize(draw(7), (80, 60)))
    text = write_film(root / "text", 3)
    (text / "9.jpg").write_text("this is no image")
    return {
        "missing": (root / "nowhere", 3, "nowhere"),
        "empty": (empty, 4, "empty"),
        "mixed": (mixed, 4, "7.jpg"),
        "text": (text, 4, "9.jpg"),
    }


@pytest.mark.parametrize("kind", ["missing", "empty", "mixed", "text"])
@pytest.mark.parametrize("side", ["board", "host"])
def test_a_bad_replay_folder_ends_at_once_with_its_name(kind: str, side: str, tmp_path: Path) -> None:
    """A folder that is missing, empty, of mixed sizes or without images ends either program with its exit code and the culprit's name."""
    folder, code, culprit = bad_folders(tmp_path)[kind]
    start = board if side == "board" else host
    with start(["run", "--camera", f"replay:{folder}", "--link", f"ipc://{tmp_path}/link"], tmp_path) as running:
        assert running.wait() == code
        assert culprit in complaint(running)


@pytest.mark.skipif(os.geteuid() == 0, reason="root may read everything")
def test_an_unreadable_folder_ends_with_exit_3(tmp_path: Path) -> None:
    """A folder without read permission is an unavailable device."""
    folder = write_film(tmp_path / "film", 3)
    folder.chmod(0)
    try:
        with board(["run", "--camera", f"replay:{folder}", "--link", f"ipc://{tmp_path}/link"], tmp_path) as running:
            assert running.wait() == 3
            assert "film" in complaint(running)
    finally:
        folder.chmod(0o700)


@pytest.mark.parametrize(
    ("arguments", "code", "culprit"),
    [
        (["--camera", "webcam:0"], 2, "webcam:0"),
        (["--camera", "replay:{film}?fps=0"], 2, "fps"),
        (["--camera", "replay:{film}?speed=3"], 2, "speed"),
        (["--camera", "replay:{film}", "--link", "carrier-pigeon://x"], 2, "carrier-pigeon"),
        (["--camera", "replay:{film}", "--link", "tcp://127.0.0.1"], 2, "port"),
        (["--camera", "replay:{film}", "--link", "ipc:///nowhere/at/all"], 3, "/nowhere/at/all"),
        (["--config", "/nowhere.toml"], 2, "/nowhere.toml"),
        ([], 2, "camera"),
        (["--speed", "3"], 2, "--speed"),
        (["--log-level", "loud"], 2, "--log-level"),
    ],
)
def test_bad_options_of_the_board_end_with_one_line(
    arguments: list[str], code: int, culprit: str, tmp_path: Path
) -> None:
    """Each bad option ends board-agent with its documented exit code and one line that names it."""
    film = write_film(tmp_path / "film", 2)
    filled = [word.format(film=film) for word in arguments]
    with board(["run", *filled], tmp_path) as running:
        assert running.wait() == code
        assert culprit in complaint(running)


@pytest.mark.parametrize(
    ("arguments", "code", "culprit"),
    [
        (["--pairs", "many"], 2, "--pairs"),
        (["--fifo", "0"], 2, "--fifo"),
        (["--fifo", "2:sometimes"], 2, "--fifo"),
        (["--pairs", "-1"], 2, "--pairs"),
        (["--rectified"], 2, "--disparities"),
        (["--rectified", "--disparities", "16", "--focal", "500"], 2, "--baseline"),
        (["--calibration", "{film}/rig.yaml"], 4, "rig.yaml"),
        (["--calibration", "{film}/rig.yaml", "--rectified"], 2, "--rectified"),
        (["--link", "tcp://*:5555"], 2, "*"),
        (["--out", "/proc/nowhere"], 3, "/proc/nowhere"),
        (["--wait", "0.3"], 3, "board"),
    ],
)
def test_bad_options_of_the_host_end_with_one_line(
    arguments: list[str], code: int, culprit: str, tmp_path: Path
) -> None:
    """Each bad option ends phone-host run with its documented exit code and one line that names it."""
    film = write_film(tmp_path / "film", 2)
    filled = [word.format(film=film) for word in arguments]
    with host(
        ["run", "--camera", f"replay:{film}?loop=1", "--link", f"ipc://{tmp_path}/link", *filled], tmp_path
    ) as running:
        assert running.wait() == code
        assert culprit in complaint(running)


@pytest.mark.parametrize("kind", ["tcp", "ipc"])
def test_a_taken_address_ends_the_second_board_at_once(kind: str, tmp_path: Path) -> None:
    """A second board on a taken port or path ends with exit 3 and names it; the first one keeps running."""
    film = write_film(tmp_path / "film", 5)
    link = f"tcp://127.0.0.1:{free_port()}" if kind == "tcp" else f"ipc://{tmp_path}/link"
    arguments = ["run", "--camera", f"replay:{film}?loop=1", "--link", link]
    with board(arguments, tmp_path, "first") as first, host([*arguments, "--pairs", "3"], tmp_path) as receiver:
        assert receiver.wait() == 0
        with board(arguments, tmp_path, "second") as second:
            assert second.wait() == 3
            assert link in complaint(second)
        with host([*arguments, "--pairs", "3"], tmp_path, "again") as receiver2:
            assert receiver2.wait() == 0
        assert first.stop() == 0


def test_too_few_pairs_before_the_stream_ends_is_exit_4(tmp_path: Path) -> None:
    """A demand-paced replay of 6 images gives 6 pairs and exit 0; asked for 7, the host ends with exit 4; the board ends with 0 both times."""
    film, link = write_film(tmp_path / "film", 6), f"ipc://{tmp_path}/link"
    arguments = ["run", "--camera", f"replay:{film}?pace=demand", "--link", link]
    for asked, code in (("6", 0), ("7", 4), ("0", 0)):
        out = tmp_path / asked
        with (
            board([*arguments, "--json"], tmp_path) as sender,
            host([*arguments, "--pairs", asked, "--out", str(out), "--save-every", "1"], tmp_path) as receiver,
        ):
            assert receiver.wait() == code
            assert sender.wait() == 0
        assert saved_numbers(out) == [(number, number) for number in range(6)]
        assert sender.json()["sent"] == 6
        assert not sender.json()["dropped"]


@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 0), (signal.SIGINT, 130)])
def test_signals_end_both_programs_with_their_summary(number: signal.Signals, code: int, tmp_path: Path) -> None:
    """SIGTERM ends with exit 0, Ctrl-C with 130; either way the account of all frames is printed and balances."""
    film, link = write_film(tmp_path / "film", 10), f"ipc://{tmp_path}/link"
    out = tmp_path / "out"
    arguments = ["run", "--camera", f"replay:{film}?loop=1", "--link", link, "--json"]
    with board(arguments, tmp_path) as sender, host([*arguments, "--out", str(out)], tmp_path) as receiver:
        until(lambda: lines(out / "delays.jsonl") >= 5, "five pairs")
        assert sender.stop(number) == code
        assert receiver.stop(number) == code
    account, report = sender.json(), receiver.json()
    assert account["grabbed"] == account["sent"] + sum(account["dropped"].values())
    (session,) = report["sessions"]
    assert session["tail"] == "known"  # the board said goodbye with its account
    assert session["grabbed"] == session["sent"] + sum(session["dropped"].values()) + session["waiting"]
    assert session["sent"] == session["received"] + session["lost"]
    assert report["pairs"] == len(ledgers(out))
    pairs = report["pairs_account"]
    assert pairs["paired"] == pairs["processed"] + pairs["undecodable"] + pairs["dropped_fifo"] + pairs["stopped"]


_IN_SMALL_DISK = """
set -e
mount -t tmpfs -o size=1m tmpfs "$1"
shift
exec "$@"
"""


def can_mount() -> bool:
    """Whether a small disk is available here: a tmpfs in a mount namespace of our own."""
    probe = subprocess.run(
        ["unshare", "-rm", "sh", "-c", "mount -t tmpfs tmpfs /mnt"], capture_output=True, check=False
    )
    return probe.returncode == 0


@pytest.mark.skipif(not can_mount(), reason="no mount namespace can be made here")
def test_a_full_disk_stops_neither_the_stream_nor_the_account(tmp_path: Path) -> None:
    """On a disk of 1 MB the run goes on when it is full, says once what could not be written, and ends with exit 4."""
    film, link = write_film(tmp_path / "film", 40), f"ipc://{tmp_path}/link"
    out = tmp_path / "disk"
    out.mkdir()
    arguments = ["run", "--camera", f"replay:{film}?fps=30&loop=1", "--link", link]
    receiving = [*arguments, "--out", str(out), "--save-every", "1", "--pairs", "120", "--json"]
    command = [
        "unshare",
        "-rm",
        "sh",
        "-c",
        _IN_SMALL_DISK,
        "sh",
        str(out),
        sys.executable,
        "-P",
        "-m",
        "phone_host.cli",
        *receiving,
    ]
    with board(arguments, tmp_path):
        run = subprocess.run(command, capture_output=True, check=False, timeout=110, text=True)
    assert run.returncode == 4, run.stderr
    assert "Traceback" not in run.stderr
    told = [line.partition(" what=")[2].split()[0] for line in run.stderr.splitlines() if "results_not_written" in line]
    assert sorted(told) == sorted(set(told)), "each trouble is told when it begins"
    assert "lines" in told
    report = json.loads(run.stdout)
    assert report["pairs"] == 120
    assert report["unwritten"]["pairs"] > 0
    assert report["unwritten"]["cause"] == "No space left on device"
