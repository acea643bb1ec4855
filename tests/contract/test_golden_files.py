"""Neighbouring versions in files: rig.yaml, delays.jsonl and report.json from an older version's demo (tests/golden), and files of newer versions."""

import json
import re
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from common.errors import DataError
from common.versions import LEDGER_FORMAT, REPORT_FORMAT, RIG_FORMAT
from phone_host.accounts.delays import DELAYS, STAGES
from phone_host.model import Side, TimeOffset
from phone_host.output.rig_yaml import read_rig, write_rig, write_time_offset
from phone_host.stereo.rectify import rectify_rig
from tests.support.golden import FOLDER, RECORDED
from tests.support.numbered import write_film
from tests.support.programs import host
from tests.support.rigs import unlike_rig

ROOT = Path(__file__).resolve().parents[2]
MARKS = ("exposed_ns", "grabbed_ns", "sent_ns", "received_ns", "queued_ns", "dequeued_ns", "done_ns")


@pytest.mark.parametrize("version", RECORDED)
def test_an_old_rig_is_read(version: str, tmp_path: Path) -> None:
    """A rig without a version has format 1: sizes, baseline and side are the demo's, and a time offset can be stored in it."""
    old = FOLDER / version / "rig.yaml"
    rig = read_rig(old)
    assert [(camera.width_px, camera.height_px) for camera in (rig.left, rig.right)] == [(640, 480), (800, 600)]
    assert rig.board_side is Side.LEFT
    assert (rig.left.matrix[0, 0], rig.left.matrix[1, 1]) == (525.0, 526.2)
    path = tmp_path / "rig.yaml"
    path.write_bytes(old.read_bytes())
    write_time_offset(path, TimeOffset(3_000_000, 200_000))
    assert read_rig(path).time_offset == TimeOffset(3_000_000, 200_000)


def test_a_rig_states_its_format(tmp_path: Path) -> None:
    """Files are written with their format version first; whole numbers up to ours are read, with or without a decimal point."""
    path = tmp_path / "rig.yaml"
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()))
    lines = path.read_text().splitlines()
    assert lines[2] == f"format_version: {RIG_FORMAT}"
    for value in (RIG_FORMAT, f"{RIG_FORMAT}."):
        path.write_text("\n".join([*lines[:2], f"format_version: {value}", *lines[3:]]) + "\n")
        assert read_rig(path).left.width_px == 640


@pytest.mark.parametrize("value", [str(RIG_FORMAT + 1), "1000000", f"{RIG_FORMAT + 1}."])
def test_a_newer_rig_is_refused(value: str, tmp_path: Path) -> None:
    """The refusal names the file, its format, our format and what to update."""
    path = rig_of_format(tmp_path, value)
    with pytest.raises(DataError) as caught:
        read_rig(path)
    asked = value.rstrip(".")
    remedy = "update tandemscan, or calibrate again"
    assert str(caught.value) == f"{path}: format_version is {asked}, this program reads up to {RIG_FORMAT}: {remedy}"


@pytest.mark.parametrize("value", ["0", "-1", "1.5", "one", "[ 1 ]", ".Nan", ".Inf"])
def test_what_is_no_format_is_refused(value: str, tmp_path: Path) -> None:
    """A version that is not a whole number above 0 makes the whole file invalid."""
    with pytest.raises(DataError, match="format_version"):
        read_rig(rig_of_format(tmp_path, value))


def test_a_newer_rig_ends_a_command_with_one_line(tmp_path: Path) -> None:
    """Exit 4 and one line on stderr, before anything is opened."""
    path = rig_of_format(tmp_path, str(RIG_FORMAT + 1))
    link, camera = f"ipc://{tmp_path}/none", f"replay:{write_film(tmp_path / 'film', 1)}"
    with host(["run", "--link", link, "--camera", camera, "--calibration", str(path)], tmp_path) as program:
        assert program.wait() == 4
    (line,) = program.stderr.splitlines()
    assert f"{path}: format_version is {RIG_FORMAT + 1}" in line


def rig_of_format(folder: Path, value: str) -> Path:
    """A valid rig that claims this format version."""
    path = folder / "rig.yaml"
    write_rig(path, unlike_rig(), rectify_rig(unlike_rig()))
    text = path.read_text()
    path.write_text(re.sub(r"^format_version: .*$", f"format_version: {value}", text, flags=re.MULTILINE))
    return path


def documented_keys(heading: str) -> set[str]:
    """The keys that docs/files.md lists under a heading."""
    section = (ROOT / "docs" / "files.md").read_text(encoding="utf-8").split(f"\n## {heading}\n")[1].split("\n## ")[0]
    cells = [line.split("|")[1] for line in section.splitlines() if line.startswith("|")]
    return {key for cell in cells for key in re.findall(r"`(\w+)`", cell)}


@pytest.mark.parametrize("version", RECORDED)
def test_old_ledgers_mean_what_is_documented(version: str) -> None:
    """Each line has only documented keys; its marks are in order, its delays lie between them and add up to the nanosecond."""
    assert LEDGER_FORMAT == 1, "a reader of older lines is needed"
    lines = (FOLDER / version / "delays.jsonl").read_text(encoding="utf-8").splitlines()
    assert lines
    for line in lines:
        ledger: dict[str, Any] = json.loads(line)
        assert set(ledger) <= documented_keys("delays.jsonl")
        marks = [ledger[mark] for mark in MARKS]
        assert marks == sorted(marks)
        between = [late - early for early, late in pairwise(marks)]
        told = [ledger[f"{name}_ns"] for name in DELAYS if name not in {"end_to_end", "starvation"}]
        assert told == between
        assert sum(told) == ledger["end_to_end_ns"] == ledger["done_ns"] - ledger["exposed_ns"]
        assert set(ledger["stages_ns"]) <= set(STAGES)
        assert sum(ledger["stages_ns"].values()) <= ledger["processing_ns"]


@pytest.mark.parametrize("version", RECORDED)
def test_old_reports_mean_what_new_ones_mean(version: str) -> None:
    """A report without a version has format 1: its delays and counts are the same as today's, and the counts balance."""
    assert REPORT_FORMAT == 1, "a reader of older reports is needed"
    report: dict[str, Any] = json.loads((FOLDER / version / "report.json").read_text(encoding="utf-8"))
    assert report.get("format_version", 1) == 1
    assert set(report["delays_ms"]) == set(DELAYS)
    assert set(report["stages_ms"]) == set(STAGES)
    frames, pairs = report["frames"], report["pairs_account"]
    waiting = frames["paired"] + frames["held"] + frames["before_clock"]
    assert frames["received"] == waiting + sum(frames["orphaned"].values())
    assert frames["paired"] == report["host_frames"]["paired"] == pairs["paired"]
    assert pairs["processed"] == report["pairs"] == report["delays_ms"]["end_to_end"]["count"]
    (session,) = report["sessions"]
    assert session["grabbed"] == session["sent"] + sum(session["dropped"].values()) + session["waiting"]
    assert session["sent"] == session["received"] + session["lost"]
