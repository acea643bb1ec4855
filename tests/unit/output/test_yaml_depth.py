"""The depth of a YAML text is never taken for less than the parser's, and real files are let through."""

from pathlib import Path

import pytest

from common.errors import DataError
from phone_host.output.rig_reader import MOST_LEVELS, is_too_deep
from phone_host.output.rig_yaml import read_rig, write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rigs import unlike_rig

_START = "%YAML:1.0\n---\n"


@pytest.mark.parametrize(
    "deep",
    [
        "x: " + "[" * 100_000,
        "x: " + "{a: " * 100_000,
        "x: " + "-" * 100_000,
        "x:\n  " + "- " * 100_000,
        "x: " + "a:" * 100_000,
        "x: [" + '"]", [\n ' * 100_000,  # closed in texts only
        "x: [" + "'[', [ # ]\n " * 100_000,  # closed in comments only
        "x: {" + "a], b: {" * 100_000,  # closed in keys only
        "".join(" " * at + "a:\n" for at in range(100)),
    ],
)
def test_a_deep_file_is_refused_before_it_is_parsed(tmp_path: Path, deep: str) -> None:
    """OpenCV's parser would overflow its stack, which no error handler survives."""
    assert is_too_deep(_START + deep)
    (tmp_path / "deep.yaml").write_text(_START + deep)
    with pytest.raises(DataError, match=r"deep\.yaml is not a calibration file|deep\.yaml has"):
        read_rig(tmp_path / "deep.yaml")


def test_real_files_are_not_deep(tmp_path: Path) -> None:
    """Neither a rig of this program nor one with long lists, texts in quotes and comments is refused."""
    write_rig(tmp_path / "rig.yaml", unlike_rig(), rectify_rig(unlike_rig()))
    text = (tmp_path / "rig.yaml").read_text()
    assert not is_too_deep(text)
    points = "".join(f"   - [ {x}., -{x}.5 ]   # a point\n   - {{ x: {x}, y: -1 }}\n" for x in range(MOST_LEVELS // 4))
    names = "".join(f'camera_{n}:\n   name: "C920 [{n}]"\n' for n in range(1000))
    matrices = text.partition("---\n")[2]
    assert not is_too_deep(_START + matrices * 50 + "points:\n" + points + names)
