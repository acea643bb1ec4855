"""A rig.yaml that was cut off, or of which a digit was spoiled, is refused with the key, never read as another rig."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.errors import DataError
from common.versions import RIG_FORMAT
from phone_host.model import RIG_PARAMETERS, Verdict
from phone_host.output.rig_views import RigViews
from phone_host.output.rig_yaml import read_rig, read_rig_views, write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rigs import unlike_rig


def _written(folder: Path) -> Path:
    rig = replace(unlike_rig(), verdict=Verdict.REJECT, covariance=np.eye(RIG_PARAMETERS))
    corners = np.zeros((2, 9, 2))
    views = RigViews(columns=3, rows=3, square_m=0.02, names=("1", "2"), left_px=corners, right_px=corners)
    write_rig(folder / "rig.yaml", rig, rectify_rig(rig), views)
    return folder / "rig.yaml"


def test_a_file_that_was_cut_off_is_refused_or_keeps_its_verdict(tmp_path: Path) -> None:
    """Wherever the file ends: a rig that was rejected does not become one that has no verdict."""
    path = _written(tmp_path)
    text = path.read_text()
    ends = [found.end() for found in re.finditer("\n", text)]
    refused = 0
    for end in {*ends[:-1], *range(40, len(text) - 1, 97)}:
        path.write_text(text[:end])
        try:
            assert read_rig(path).is_rejected
        except DataError:
            refused += 1
    assert refused > 90  # what is left ends in the views, or between two of the last keys


def test_a_nul_character_is_named(tmp_path: Path) -> None:
    """OpenCV would end there and lose what follows."""
    path = _written(tmp_path)
    path.write_text(path.read_text().replace("# standard", "# st\0ndard", 1))
    with pytest.raises(DataError, match="holds a NUL character: it is damaged"):
        read_rig(path)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("525., 0., 315.", "529., 0., 315.", "M1 has a focal length of 528.00 px, but P1 was made of one of 526.00 px"),
        ("525., 0., 315.", "525., 4., 315.", "M1 is skewed"),
        ("1130., 0., 652.", "1130., 4., 652.", "M2 is skewed"),
        ("rms_left", "rms_life", "rms_left is missing: the file was cut off"),
        ("covariance", "covarianza", "covariance is missing: the file was cut off"),
    ],
)
def test_a_spoiled_digit_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    """What contradicts the rest of the file, or no camera has, is refused by key."""
    path = _written(tmp_path)
    assert old in path.read_text()
    path.write_text(path.read_text().replace(old, new, 1))
    with pytest.raises(DataError, match=said):
        read_rig(path)


@pytest.mark.parametrize(
    ("field", "change", "said"),
    [
        ("R_right", 2, "R contradicts R1 and R2"),
        ("P_right", 0, "P2 has a baseline of"),
        ("P_left", 0, "P2 has another focal length than P1|Q contradicts P1"),
        ("Q", 11, "Q contradicts P1"),
    ],
)
def test_a_rectification_that_is_of_another_rig_is_refused(tmp_path: Path, field: str, change: int, said: str) -> None:
    """The rig and what other programs use of the file tell the same."""
    rig = unlike_rig()
    made = rectify_rig(rig)
    spoiled = getattr(made, field).copy()
    spoiled.flat[change] += 0.01 * max(1.0, abs(spoiled.flat[change]))
    write_rig(tmp_path / "rig.yaml", rig, replace(made, **{field: spoiled}))
    with pytest.raises(DataError, match=said):
        read_rig(tmp_path / "rig.yaml")


def test_a_translation_that_points_elsewhere_is_refused(tmp_path: Path) -> None:
    """T of the same length, and R2 that does not turn it into the rows."""
    rig = unlike_rig()
    aside = replace(rig, t_right_left_m=rig.t_right_left_m * [1, -1, 1])
    write_rig(tmp_path / "rig.yaml", aside, rectify_rig(rig))
    with pytest.raises(DataError, match="T contradicts R2"):
        read_rig(tmp_path / "rig.yaml")


def test_files_of_other_programs_need_no_rectification(tmp_path: Path) -> None:
    """Without a version any of R1 to Q may be missing; what is there must agree. A focal length of 0 is no division."""
    path = _written(tmp_path)
    text = path.read_text().replace(f"format_version: {RIG_FORMAT}\n", "")
    for missing in (("R1", "R2", "P1", "P2", "Q"), ("P1",), ("P2",), ("Q",), ("R1",), ("R2",)):
        kept = text
        for key in missing:
            kept = kept.replace(f"\n{key}:", f"\nno_{key}:")
        path.write_text(kept)
        assert read_rig(path).is_rejected
    focal = re.search(r"\nP2:.*?data: \[ (\S+),", text, re.DOTALL)
    assert focal is not None
    path.write_text(text[: focal.start(1)] + "0." + text[focal.end(1) :])
    with pytest.raises(DataError, match="P2 has a baseline of nan mm"):
        read_rig(path)


def test_views_whose_counts_and_data_differ_are_named(tmp_path: Path) -> None:
    """OpenCV raises an error of its own for such a matrix."""
    path = _written(tmp_path)
    text = path.read_text()
    head, views = text[: text.index("\nviews:")], text[text.index("\nviews:") :]
    path.write_text(head + views.replace("cols: 18", "cols: 19", 1))
    with pytest.raises(DataError, match=r"views.left does not hold the corners of each pair"):
        read_rig_views(path)
