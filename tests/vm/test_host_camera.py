"""phone-host with its own V4L2 camera: the booted machine is board and host at once, and each program has one of two webcams."""

import json
import shutil
import subprocess
import sys
import tarfile
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path
from typing import Any

import pytest
from packaging.requirements import Requirement

from tests.support.programs import PATIENCE_S, until
from tests.vm import uvc
from tests.vm.conftest import CAMERA, READOUT_MS, ROOT, booted
from tests.vm.guest import LINK_PORT, Guest
from tests.vm.machine import Architecture
from tests.vm.stream import FPS, FRAMES, Film, check_counts, check_delays, check_journal, check_pairs, webcam_skew
from tests.vm.webcam import Webcam

pytestmark = pytest.mark.timeout(600)  # the first test boots the machine

GUEST_PYTHON = (3, 11)
"""Debian 12's; packages with compiled parts fit one version only."""

BY_ID = "v4l2:/dev/v4l/by-id/usb-tandemscan_Board_Test_Camera_{}-video-index0?" + CAMERA.partition("?")[2]
HOST = "PYTHONPATH=/mnt python3 -P -m phone_host.cli"


def required_packages() -> set[str]:
    """Return the names of all packages that an installation of the host without extras brings."""
    names, waiting = set[str](), ["tandemscan"]
    while waiting:
        for line in metadata.requires(waiting.pop()) or ():
            needed = Requirement(line)
            if needed.name not in names and (needed.marker is None or needed.marker.evaluate({"extra": ""})):
                names.add(needed.name)
                waiting.append(needed.name)
    return names


def write_disk(folder: Path) -> Path:
    """An image with phone-host and its packages as installed here, without tests."""
    root = folder / "root"
    for name in required_packages():
        for file in metadata.files(name) or ():
            if file.parts[0] != ".." and "tests" not in file.parts and file.suffix != ".pyc":
                (root / file).parent.mkdir(parents=True, exist_ok=True)
                shutil.copy(str(file.locate()), root / file)
    for part in ("common", "phone_host"):
        shutil.copytree(ROOT / part, root / part, ignore=shutil.ignore_patterns("__pycache__"))
    image = folder / "host.ext4"
    make = shutil.which("mke2fs", path="/usr/sbin:/sbin:/usr/bin:/bin")
    assert make is not None, "apt install e2fsprogs"
    subprocess.run([make, "-q", "-t", "ext4", "-O", "^has_journal", "-d", root, image, "500M"], check=True)
    return image


@pytest.fixture(scope="module")
def machine(package: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guest]:
    """The booted machine with both programs."""
    if sys.version_info[:2] != GUEST_PYTHON:
        pytest.skip(
            f"packages of Python {sys.version_info[0]}.{sys.version_info[1]} do not run in the guest, it has 3.11"
        )
    with booted(Architecture.AMD64, write_disk(tmp_path_factory.mktemp("disk"))) as guest:
        guest.sh("mount -o ro /dev/vdb /mnt")
        guest.install(package)
        yield guest


@pytest.fixture(scope="module")
def cameras(machine: Guest, film: Film) -> Iterator[tuple[Webcam, Webcam]]:
    """The left view's webcam for the board, the right view's for the host, both plugged in."""
    views = [(film.right / f"{number}.jpg").read_bytes() for number in range(FRAMES)]
    left = Webcam(film.frames, FPS, READOUT_MS * 1_000_000, uvc.Model(serial="LEFT"))
    right = Webcam(views, FPS, READOUT_MS * 1_000_000, uvc.Model(serial="RIGHT"))
    left.plug(machine)
    right.plug(machine, usb_port=1)
    machine.configure(BY_ID.format("LEFT"))
    yield left, right
    left.close()
    right.close()


def pairs_so_far(machine: Guest) -> int:
    """The lines of the host's delays."""
    return int(machine.sh("cat /srv/out/delays.jsonl 2>/dev/null | wc -l"))


def test_two_webcams_are_paired_and_a_pulled_one_comes_back(
    machine: Guest, cameras: tuple[Webcam, Webcam], tmp_path: Path
) -> None:
    """Every pair shows one moment by the webcams' own record; the host's camera, pulled and plugged in again, resumes, and the report says so."""
    left, right = cameras
    run = f"{HOST} run --link tcp://127.0.0.1:{LINK_PORT} --camera '{BY_ID.format('RIGHT')}' --out /srv/out --save-every 1 --json"
    host = machine.popen(f"cd /; {run} > /srv/report 2> /srv/host.err & echo $!; wait; cat /srv/report")
    assert host.stdout is not None
    pid = host.stdout.readline().decode().strip()
    until(
        lambda: pairs_so_far(machine) > 0, "the program has started"
    )  # an emulated processor takes its time to load OpenCV
    until(lambda: pairs_so_far(machine) >= 40, "40 pairs of two webcams")
    right.unplug()
    until(lambda: "camera_lost" in machine.sh("cat /srv/host.err"), "the host notices that its camera is gone")
    before = pairs_so_far(machine)
    right.plug(machine, usb_port=2)
    until(lambda: pairs_so_far(machine) >= before + 20, "pairs after the plug")
    machine.sh(f"kill {pid}")
    report: dict[str, Any] = json.loads(host.communicate(timeout=PATIENCE_S)[0])
    assert "Traceback" not in machine.sh("cat /srv/host.err")
    machine.sh("tar -C /srv -cf /srv/out.tar out")
    machine.get("/srv/out.tar", tmp_path / "out.tar")
    with tarfile.open(tmp_path / "out.tar") as archive:
        archive.extractall(tmp_path, filter="data")
    check_pairs(tmp_path / "out", webcam_skew(left.late_ns, right.late_ns))
    check_delays(tmp_path / "out")
    check_counts(report)
    check_journal(machine)
    page = (tmp_path / "out" / "index.html").read_text()
    for row in ("<td>unplugged</td><td>1</td>", "<td>held: focus</td><td>45</td>"):
        assert row in page
    camera = report["host_frames"]["camera"]
    assert (camera["unplugged"], camera["returned"]) == (1, 1)
    assert camera["held"]["focus"] == uvc.CONTROLS[uvc.FOCUS].found
    assert camera["period_ms"] == pytest.approx(1000 / FPS, rel=0.2)


def test_the_hosts_doctor_streams_from_its_camera(machine: Guest, cameras: tuple[Webcam, Webcam]) -> None:
    """phone-host doctor finds its packages, verifies the host's camera by streaming, and gets the board's answer."""
    assert cameras[1].plugged
    asked = f"--link tcp://127.0.0.1:{LINK_PORT} --camera '{BY_ID.format('RIGHT')}' --wait 30 --out /srv/out --json"
    shown = machine.sh(f"cd / && {HOST} doctor {asked}")
    checks = {check["what"]: check for check in json.loads(shown)["checks"]}
    assert checks["cv2"]["verdict"] == checks["numpy"]["verdict"] == "ok"
    assert "sound frames" in checks["stream"]["finding"]
    assert "clock known to" in checks["board"]["finding"]


def folders(machine: Guest) -> list[str]:
    """The results folders that the user's unit has made, oldest first."""
    return machine.sh("ls -d ~/tandemscan-scans/* 2>/dev/null || true").split()


def await_pairs(machine: Guest, runs: int) -> str:
    """Wait until the newest of this many runs has 10 pairs; return its folder."""
    until(lambda: len(folders(machine)) == runs, "a folder of its own for each start")
    newest = folders(machine)[-1]
    until(lambda: int(machine.sh(f"wc -l < {newest}/delays.jsonl")) >= 10, "10 pairs")
    return newest


def test_the_users_unit_pairs_frames(machine: Guest, cameras: tuple[Webcam, Webcam]) -> None:
    """deploy/host's unit, with a settings file as it describes, loads without a warning, pairs frames and ends properly; a later start keeps the results."""
    assert all(camera.plugged for camera in cameras)
    # As a unit of the system manager its home folder is root's: there, a checkout's command replaces the one of `make venv`.
    command = "~/tandemscan/.venv/bin/phone-host"
    machine.sh(
        f"install -D -m 755 /dev/stdin {command} <<'E'\n#!/bin/sh\ncd / && export PYTHONPATH=/mnt && exec python3 -P -m phone_host.cli \"$@\"\nE"
    )
    settings = f'link = ["tcp://127.0.0.1:{LINK_PORT}"]\ncamera = "{BY_ID.format("RIGHT")}"'
    machine.sh(f"install -D -m 600 /dev/stdin ~/.config/tandemscan/phone-host.toml <<'E'\n{settings}\nE")
    machine.put(ROOT / "deploy" / "host" / "phone-host.service", "/run/systemd/system")
    unit = "/run/systemd/system/phone-host.service"
    assert machine.sh(f"systemd-analyze verify --man=no {unit} 2>&1") == ""
    machine.sh("systemctl daemon-reload")
    try:
        for runs in (1, 2):
            machine.sh("systemctl start phone-host")
            newest = await_pairs(machine, runs)
            machine.sh("systemctl stop phone-host")
            assert machine.sh("systemctl show -P Result -P NRestarts phone-host").split() == ["success", "0"]
            check_counts(json.loads(machine.sh(f"cat {newest}/report.json")))
    finally:
        machine.sh(f"systemctl stop phone-host; rm -r {unit} ~/tandemscan; systemctl daemon-reload")
    assert all(machine.sh(f"cat {folder}/report.json") for folder in folders(machine))
