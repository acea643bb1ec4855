"""phone-host calibrate --import and --export in this process: what is written, and what is refused before anything is."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from common.errors import DataError
from phone_host.cli import main
from phone_host.model import Side, TimeOffset
from phone_host.output.rig_files.imported import import_rig, read_own_rig
from phone_host.output.rig_views import RigViews
from phone_host.output.rig_yaml import read_rig, read_rig_views, write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.unit.output.test_rig_files_kalibr import KALIBR
from tests.unit.report.test_report_keys import described_words, keys_of

_UPRIGHT = KALIBR.replace("- [0.0, -1.0, 0.0, 0.0]", "- [1, 0, 0, -0.12]").replace(
    "- [1.0, 0.0, 0.0, -0.12]", "- [0, 1, 0, 0]"
)


@pytest.fixture
def chain(tmp_path: Path) -> Path:
    """A camchain of two parallel cameras 120 mm apart."""
    path = tmp_path / "camchain.yaml"
    path.write_text(_UPRIGHT)
    return path


def _told(capsys: pytest.CaptureFixture[str], *words: str | Path) -> dict[str, Any]:
    assert main([*map(str, words), "--json"]) == 0
    told: dict[str, Any] = json.loads(capsys.readouterr().out)
    return told


def test_an_imported_chain_becomes_rig_yaml(chain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """rig.yaml and report.json appear; baseline, kind and sizes are told."""
    out = tmp_path / "new" / "rig.yaml"
    told = _told(capsys, "calibrate", "--import", chain, "--out", out)
    assert told == json.loads((tmp_path / "new" / "report.json").read_text())
    assert (told["command"], told["imported"]["kind"], told["baseline_mm"]) == ("calibrate", "kalibr", 120.0)
    assert told["sizes"] == {"left": "640x480", "right": "640x480"}
    np.testing.assert_allclose(read_rig(out).t_right_left_m, [-0.12, 0, 0])


def test_a_rig_is_exported_into_folders_beside_it(
    chain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Each kind gets a folder; rig.yaml, which is imported and --out at once, and its report stay as they are."""
    out = tmp_path / "rig.yaml"
    _told(capsys, "calibrate", "--import", chain, "--out", out)
    before = out.read_bytes(), (tmp_path / "report.json").read_bytes()
    words = ["--export", "ros", "--export", "kalibr", "--export", "ros", "--export", "euroc"]
    _told(capsys, "calibrate", "--import", out, *words, "--out", out)
    told = _told(capsys, "calibrate", "--import", out, *words, "--out", out)  # which replaces them
    assert keys_of(told) - set(told["exported"]) <= described_words(
        "What `--json` prints", "report.json of `calibrate`"
    )
    assert sorted(told["exported"]) == ["euroc", "kalibr", "ros"]
    assert (out.read_bytes(), (tmp_path / "report.json").read_bytes()) == before
    for kind in ("ros", "kalibr", "euroc"):
        found = import_rig((tmp_path / kind,))
        assert found.kind.value == kind
        np.testing.assert_allclose(found.rig.right.matrix, read_rig(out).right.matrix)
    assert main(["calibrate", "--import", str(out), "--export", "colmap", "--out", str(out)]) == 0
    assert f"exported colmap: {tmp_path / 'colmap' / 'cameras.txt'}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("words", "code", "said"),
    [
        ([], 2, "neither pictures nor --live nor --import"),
        (["l", "r", "--board", "9x6"], 2, "--square is missing"),
        (["l", "r", "--board", "9x6", "--square", "25mm", "--unit", "1mm"], 2, "--unit without --import"),
        (["l", "r", "--import", "C"], 2, "--import and pictures contradict"),
        (["--board", "9x6", "--import", "C"], 2, "--import and --board contradict"),
        (["--rotate-right", "90", "--import", "C"], 2, "--import and --rotate-right contradict"),
        (["--camera", "browser:", "--import", "C"], 2, "--import and --camera contradict"),
        (["--snapshots", "d", "--import", "C"], 2, "--import and --snapshots contradict"),
        (["--no-sound", "--import", "C"], 2, "--import and --no-sound contradict"),
        (["--baseline", "500mm", "--import", "C"], 4, "are 120.0 mm apart, and you measured 500.0 mm: say with --unit"),
        (["--import", "C", "--unit", "squares"], 2, "--unit is 'squares'"),
        (["--import", "C", "--size", "640"], 2, "--size is '640'"),
        (["--import", "C", "--size", "640x480,1x1,2x2"], 2, "--size is"),
        (["--import", "C", "--size", "320x240"], 4, "is for images of 640x480 px, and --size says otherwise"),
        (["--import", "C", "--unit", "1km"], 2, "--unit is"),
        (["--import", "C", "--unit", "1mm"], 4, "puts the cameras 0.12 mm apart"),
        (["--import", "C", "C", "C"], 2, "--import has 3 files"),
        (["--import", "missing.yaml"], 4, "missing.yaml cannot be read"),
    ],
)
def test_what_makes_no_sense_is_told_in_one_line(
    words: list[str], code: int, said: str, chain: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit 2 for options, 4 for files; nothing is written."""
    tmp_path = chain.parent
    given = [str(chain) if word == "C" else word for word in words]
    assert main(["calibrate", *given, "--out", str(tmp_path / "rig.yaml")]) == code
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["camchain.yaml"]


def test_nothing_foreign_is_replaced(chain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither the imported file nor another one becomes rig.yaml, and an export spares what it did not write."""
    assert main(["calibrate", "--import", str(chain), "--out", str(chain)]) == 2
    assert "is the file that is imported" in capsys.readouterr().err
    letter = tmp_path / "letter.txt"
    letter.write_text("dear")
    assert main(["calibrate", "--import", str(chain), "--out", str(letter)]) == 3
    (tmp_path / "kalibr").mkdir()
    theirs = tmp_path / "kalibr" / "camchain.yaml"
    theirs.write_text(_UPRIGHT)
    for given, code in ((chain, 3), (theirs, 2)):
        assert (
            main(["calibrate", "--import", str(given), "--export", "kalibr", "--out", str(tmp_path / "rig.yaml")])
            == code
        )
    assert (letter.read_text(), theirs.read_text(), chain.read_text()) == ("dear", _UPRIGHT, _UPRIGHT)


def test_the_calibration_of_another_program_is_not_taken_for_rig_yaml(
    chain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """--calibration with a file or folder of Kalibr, ROS, EuRoC, COLMAP: the error names the command that imports it. JSON is nobody's."""
    kinds = ("ros", "kalibr", "euroc", "colmap", "opencv-xml")
    out = tmp_path / "rig.yaml"
    _told(
        capsys, "calibrate", "--import", chain, *(word for kind in kinds for word in ("--export", kind)), "--out", out
    )
    for kind, file, given in (
        ("ros", "ros/left.yaml", "ros"),
        ("ros", "ros", "ros"),
        ("kalibr", "kalibr/camchain.yaml", "kalibr/camchain.yaml"),
        ("euroc", "euroc/cam1/sensor.yaml", "euroc"),
        ("colmap", "colmap/images.txt", "colmap"),
        ("opencv", "opencv-xml/stereo.xml", "opencv-xml/stereo.xml"),
    ):
        with pytest.raises(DataError) as caught:
            read_own_rig(tmp_path / file)
        assert f"is the calibration of another program ({kind})" in caught.value.problem
        assert caught.value.remedy == f"make one: phone-host calibrate --import {tmp_path / given} --out rig.yaml"
    (tmp_path / "ros" / "left.yaml").rename(tmp_path / "it is.yaml")
    with pytest.raises(DataError) as caught:
        read_own_rig(tmp_path / "it is.yaml")
    assert caught.value.remedy.endswith(f"--import '{tmp_path / 'it is.yaml'}' OTHER --out rig.yaml")
    (tmp_path / "rig.json").write_text('{"R": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "T": [1, 2, 3]}')
    with pytest.raises(DataError, match="is not a calibration file"):
        read_own_rig(tmp_path / "rig.json")
    assert read_own_rig(out).left.width_px == 640
    assert main(["measure", "a.png", "b.png", "--calibration", str(chain), "--points", "1,1"]) == 4


def test_an_import_says_what_looks_wrong(chain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A wrong unit makes cameras that hardly any rig has; a rejected rig stays rejected; a calib.txt is for rectified images of one size."""
    out = tmp_path / "rig.yaml"
    assert main(["calibrate", "--import", str(chain), "--unit", "50m", "--out", str(out)]) == 0
    assert "note     cameras 6000 mm apart are unusual: check the unit" in capsys.readouterr().out
    assert main(["calibrate", "--import", str(chain), "--out", str(out), "--export", "kitti"]) == 0
    told = capsys.readouterr().out
    assert "unusual" not in told
    assert "for rectified images of " in told
    out.write_text(out.read_text() + "verdict: reject\n")
    assert main(["calibrate", "--import", str(out), "--out", str(tmp_path / "again.yaml")]) == 0
    assert "verdict  reject\nrun and stereo refuse this calibration" in capsys.readouterr().out


def test_an_import_is_on_the_side_that_is_named_and_keeps_what_it_holds(
    chain: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """--board-side goes into rig.yaml and turns the time offset round; the imported file is not changed by it. A rig.yaml keeps its views, and takes the place of none that has others."""
    out, other = tmp_path / "rig.yaml", tmp_path / "other.yaml"
    assert _told(capsys, "calibrate", "--import", chain, "--baseline", "121mm", "--board-side", "right", "--out", out)
    assert read_rig(out).board_side is Side.RIGHT
    corners = np.zeros((1, 54, 2))
    views = RigViews(columns=9, rows=6, square_m=0.02, names=("a",), left_px=corners, right_px=corners)
    rig = replace(read_rig(out), time_offset=TimeOffset(7, 3))
    write_rig(out, rig, rectify_rig(rig), views)
    assert main(["calibrate", "--import", str(out), "--board-side", "left", "--out", str(out)]) == 2
    assert "--board-side left would change" in capsys.readouterr().err
    assert _told(capsys, "calibrate", "--import", out, "--board-side", "left", "--out", other)["board_side"] == "left"
    assert (read_rig(other).board_side, read_rig(other).time_offset) == (Side.LEFT, TimeOffset(-7, 3))
    kept = read_rig_views(other)
    assert kept is not None
    assert kept.names == ("a",)
    assert _told(capsys, "calibrate", "--import", chain, "--out", other)["earlier_rig"] == "other.yaml.old"
