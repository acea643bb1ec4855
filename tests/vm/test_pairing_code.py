"""A board and a host are paired as their owner would do it: over a network, with the code that the board's owner is shown."""

import json
import os
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from common.keys import KeyFolder
from tests.support.programs import until
from tests.vm.conftest import CAMERA
from tests.vm.guest import UNIT, Guest
from tests.vm.stream import Film, Skew, streaming
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

STATE = "/var/lib/tandemscan"


@pytest.fixture(autouse=True)
def _own_keys(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the host's keys in a folder of the test's."""
    monkeypatch.setenv("PHONE_HOST_KEYS", str(tmp_path / "keys"))


def test_pairing_by_the_code_that_the_owner_is_shown(
    guest: Guest, webcam: Webcam, film: Film, skew: Skew, tmp_path: Path
) -> None:
    """On a network the board refuses a host; the code from `board-agent pair` pairs them and is in no journal; pairs of frames are correct; a forgotten host is refused again."""
    assert webcam.plugged
    guest.configure(CAMERA, secured=True)
    try:
        until(lambda: "pairing_open" in guest.journal(), "the board takes in its first host")
        pairing = subprocess.Popen(
            [
                sys.executable,
                "-P",
                "-m",
                "phone_host.cli",
                "pair",
                "--link",
                guest.link,
                "--pairing-port",
                str(guest.door_port),
            ],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=os.environ,
        )
        until(lambda: "pairing_asked" in guest.journal() or pairing.poll() is not None, "the journal tells who asks")
        owner = guest.popen("board-agent pair --seconds 120")
        assert owner.stdout is not None
        code = owner.stdout.readline().decode().split()[-1]
        out, err = pairing.communicate(f"{code}\n", timeout=60)
        owner.communicate(timeout=60)
        assert code not in guest.journal()
        assert pairing.returncode == 0, err + guest.journal()[-2000:]
        assert "paired with board" in out
        until(lambda: "pairing_closed" in guest.journal(), "the door is closed")
        with streaming(guest, film.right, tmp_path / "out") as stream:
            stream.more(20, "with keys")
            report = stream.finish(skew)
        assert len(report["sessions"]) == 1
        check_state(guest, KeyFolder(tmp_path / "keys").own().public)
        name = json.loads(guest.sh("board-agent keys --json"))["peers"][0]["name"]
        guest.sh(f"board-agent keys --forget {name} && systemctl restart {UNIT}")
        until(lambda: guest.journal().count("pairing_open") > 1, "the board is up again, and knows nobody")
        with streaming(guest, film.right, tmp_path / "refused") as refused:
            assert refused.receiver.wait() == 3
        assert "does not know this machine's key" in refused.receiver.stderr
    finally:
        guest.configure(CAMERA)


def check_state(guest: Guest, public: str) -> None:
    """The board's folder of keys belongs to the service alone, whoever wrote to it, and root's `keys` shows the host that was paired."""
    for line in guest.sh(f"stat -c '%n %U %a' {STATE} {STATE}/key {STATE}/peers.json").splitlines():
        path, owner, mode = line.split()
        assert owner == "tandemscan", line
        assert stat.S_IMODE(int(mode, 8)) & 0o077 == 0, line
        assert path.startswith(STATE)
    shown = json.loads(guest.sh("board-agent keys --json"))
    assert shown["folder"] == STATE
    assert [peer["key"] for peer in shown["peers"]] == [public]
    checks = json.loads(guest.sh("board-agent doctor --json || true"))["checks"]
    assert [(check["verdict"], check["finding"]) for check in checks if check["what"] == "keys"] == [
        ("ok", f"{STATE} knows {shown['peers'][0]['name']}")
    ]


def test_the_owner_pairs_on_the_boards_terminal(guest: Guest, webcam: Webcam) -> None:
    """`board-agent pair` as root shows a code that a host can use at once, and says who came."""
    assert webcam.plugged
    guest.configure(CAMERA, secured=True)
    try:
        guest.until("StatusText", "waiting for a host", "the agent serves")
        owner = guest.popen("board-agent pair --seconds 120")
        assert owner.stdout is not None
        code = owner.stdout.readline().decode().split()[-1]
        command = ["pair", "--link", guest.link, "--pairing-port", str(guest.door_port), "--code", code, "--json"]
        done = subprocess.run(
            [sys.executable, "-P", "-m", "phone_host.cli", *command],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        said, _ = owner.communicate(timeout=60)
        assert b"paired with" in said
        assert json.loads(done.stdout)["key"] == json.loads(guest.sh("board-agent keys --json"))["public"]
    finally:
        guest.configure(CAMERA)
