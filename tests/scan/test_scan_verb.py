"""`phone-host scan` on what cannot be scanned: one line each, the right exit code, nothing half written."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import SettingsError
from phone_host.cli import main
from phone_host.jobs.scan_request import box_of
from phone_host.model.rig import Verdict
from phone_host.output.rig_yaml import write_rig
from phone_host.scan.blocks import Box
from phone_host.stereo.rectify import rectify_rig
from tests.support.still_life import small_rig


@pytest.fixture(scope="module")
def black(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three black pairs, a folder with one of them, an empty folder, the rig, and the same rejected by its calibration."""
    folder, rig = tmp_path_factory.mktemp("black"), small_rig()
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig))
    write_rig(folder / "rejected.yaml", replace(rig, verdict=Verdict.REJECT), rectify_rig(rig))
    for side, model in (("left", rig.left), ("right", rig.right)):
        (folder / side).mkdir()
        (folder / f"one_{side}").mkdir()
        for number in range(3):
            cv2.imwrite(str(folder / side / f"{number}.png"), np.zeros((model.height_px, model.width_px), np.uint8))
        (folder / f"one_{side}" / "0.png").write_bytes((folder / side / "0.png").read_bytes())
    (folder / "empty").mkdir()
    return folder


def run(black: Path, out: Path, *words: str) -> int:
    """Call the verb; paths are relative to the folder."""
    given = [str(black / word) if (black / word).exists() else word for word in words]
    return main(["scan", *given, "--out", str(out)])


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["left", "right"], (2, "neither --calibration nor --rectified is given")),
        (["left", "right", "--calibration", "rig.yaml", "--camera", "replay:right"], (2, "--camera beside pictures")),
        (["left", "right", "--calibration", "rig.yaml", "--record", "x.mcap"], (2, "--record beside pictures")),
        (["left", "right", "--calibration", "rig.yaml", "--pairs", "0"], (2, "--pairs beside pictures")),
        (["--calibration", "rig.yaml"], (2, "neither pictures nor cameras are given")),
        (["--camera", "replay:right"], (2, "no --calibration is given, so there are no metres")),
        (["--camera", "replay:right", "--calibration", "rig.yaml", "--flip-left", "h"], (2, "turn pictures in files")),
        (["--replay", "nowhere.mcap", "--calibration", "rig.yaml"], (4, "nowhere.mcap")),
        (["left", "right", "--rectified"], (2, "neither a focal length nor a baseline")),
        (["left", "right", "--rectified", "--disparities", "16"], (2, "neither a focal length nor a baseline")),
        (["left", "empty", "--calibration", "rig.yaml"], (4, "is empty")),
        (["left", "nowhere", "--calibration", "rig.yaml"], (4, "does not exist")),
        (["one_left", "one_right", "--calibration", "rig.yaml"], (4, "there is only one pair")),
        (["left", "right", "--calibration", "rig.yaml"], (4, "none of the 3 pairs has depth")),
        (["left", "right", "--calibration", "rejected.yaml"], (4, "was rejected by its own calibration")),
        (["left", "right", "--calibration", "rig.yaml", "--mat", "--turntable"], (2, "--turntable beside --mat")),
        (["--mat", "left", "right", "--calibration", "rig.yaml"], (2, "write --mat behind LEFT and RIGHT")),
        (["--mat", "lft", "right", "--calibration", "rig.yaml"], (2, "--mat is 'lft'")),
        (["left", "right", "--calibration", "rig.yaml", "--mat", "10x8:25mm"], (2, "--mat is '10x8:25mm'")),
        (["left", "right", "--calibration", "rig.yaml", "--mat", "--axes", "y-up"], (2, "--axes y-up beside --mat")),
        (["left", "right", "--calibration", "rig.yaml", "--voxel", "0.01"], (2, "--voxel is 0.01 mm")),
        (["left", "right", "--calibration", "rig.yaml", "--memory", "1MB"], (2, "--memory is 1 MB")),
        (["left", "right", "--calibration", "rig.yaml", "--box", "1x2@3,4,5"], (2, "--box is '1x2@3,4,5'")),
    ],
)
def test_what_cannot_be_scanned_is_one_line(
    black: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str], words: list[str], expected: tuple[int, str]
) -> None:
    """It names the cause, and writes no model."""
    code, told = expected
    assert run(black, tmp_path / "o", *words) == code
    said = capsys.readouterr()
    assert told in said.err
    assert len(said.err.strip().splitlines()) == 1
    assert said.out == ""
    assert not (tmp_path / "o" / "model.ply").exists()


def test_pairs_that_cannot_be_read_are_named(black: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """If none can be, the first is told."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        for name in ("0.png", "1.png"):
            (tmp_path / side / name).write_bytes(b"\x89PNG\r\n\x1a\n broken")
    rig = str(black / "rig.yaml")
    assert (
        main(
            [
                "scan",
                str(tmp_path / "left"),
                str(tmp_path / "right"),
                "--calibration",
                rig,
                "--out",
                str(tmp_path / "o"),
            ]
        )
        == 4
    )
    assert "none of the 2 pairs can be computed" in capsys.readouterr().err


def test_a_box_is_sides_and_a_middle() -> None:
    """In mm; anything else is refused."""
    box = box_of("400x300x200@-10, 20,900")
    assert box == Box(pytest.approx((-0.21, -0.13, 0.8)), pytest.approx((0.19, 0.17, 1.0)))  # type: ignore[arg-type]  # compared only
    for wrong in ("", "400x300x200", "400x300x0@0,0,0", "axbxc@0,0,0", "400x300x200@0,0"):
        with pytest.raises(SettingsError, match="--box is"):
            box_of(wrong)
