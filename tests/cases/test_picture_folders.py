"""Folders of pictures whose names or tables hold the times. docs/recordings.md has a row for each."""

from pathlib import Path

import pytest

from common.recording.opened import open_recorded
from phone_host.cli import main
from tests.support import foreign_recordings as other
from tests.support.foreign_recordings import PERIOD_NS, ZERO_NS, picture


def _folders(folder: Path, names: list[str]) -> list[str]:
    """Two folders with pictures of these names."""
    for side in (0, 1):
        (folder / str(side)).mkdir()
        for number, name in enumerate(names):
            (folder / str(side) / f"{name}.png").write_bytes(other.png(picture(side, number)))
    return [str(folder / "0"), str(folder / "1")]


def _imported(folder: Path, words: list[str]) -> list[int]:
    out = folder / "out.mcap"
    out.unlink(missing_ok=True)
    assert main(["sessions", "import", *words, "--out", str(out)]) == 0
    found = open_recorded(out).images
    assert len(found) == 2
    stamps = {tuple(shown.image.stamp_ns for shown in stream) for stream in found.values()}
    assert len(stamps) == 1
    return list(next(iter(stamps)))


_TIMES = [ZERO_NS + number * PERIOD_NS for number in range(4)]
_NAMED_BY_TIMES = {
    "ns": [f"{at}" for at in _TIMES],
    "us": [f"{at // 1000}" for at in _TIMES],
    "ms": [f"{at // 10**6}" for at in _TIMES],
    "s": [f"{at // 10**9}.{at % 10**9:09}" for at in _TIMES],
    "us since the camera began": [f"{at}" for at in range(5_000_000, 5_400_000, 100_000)],
}
NAMES: dict[str, tuple[list[str], list[str], list[int]]] = {
    "ns": ([f"{at}" for at in _TIMES], [], _TIMES),
    "us": ([f"{at // 1000}" for at in _TIMES], [], _TIMES),
    "ms": ([f"{at // 10**6}" for at in _TIMES], [], _TIMES),
    "seconds": ([f"{at // 10**9}.{at % 10**9:09}" for at in _TIMES], [], _TIMES),
    "us since the camera began": (
        [f"{at}" for at in range(5_000_000, 5_400_000, 100_000)],
        ["--stamps-in", "us"],
        [at * 1000 for at in range(5_000_000, 5_400_000, 100_000)],
    ),
    "numbers, one missing": (
        ["0003", "0004", "0006", "0007"],
        ["--fps", "20"],
        [946_684_800 * 10**9 + at * 50_000_000 for at in (0, 1, 3, 4)],
    ),
    **{
        f"times in {unit}, one missing, at a rate": (
            [names[at] for at in (0, 1, 3)],
            ["--fps", "20"],
            [946_684_800 * 10**9 + at * 50_000_000 for at in (0, 1, 3)],
        )
        for unit, names in _NAMED_BY_TIMES.items()
    },
}


@pytest.mark.parametrize("kind", NAMES)
def test_names_are_times_in_the_unit_that_is_plausible(tmp_path: Path, kind: str) -> None:
    """Dates in any unit are read; of others the unit is given, or the rate, which leaves room for an image that is missing, also where the names are times."""
    names, options, expected = NAMES[kind]
    assert _imported(tmp_path, [*_folders(tmp_path, names), *options]) == expected


def test_hidden_files_are_no_pictures(tmp_path: Path) -> None:
    """MacOS writes `._0003.png` beside each picture on a stick: it is left out, as it is where pictures are paired."""
    folders = _folders(tmp_path, ["0003", "0004"])
    for name in ("._0003.png", ".DS_Store"):
        (Path(folders[0]) / name).write_bytes(b"Mac OS X")
    assert len(_imported(tmp_path, [*folders, "--fps", "20"])) == 2


TABLES: dict[str, tuple[list[str], list[str], list[int]]] = {
    "csv in us, with a head": (["timestamp,filename", *(f"{at // 1000}" for at in _TIMES)], [], _TIMES),
    "csv in ms": ([f"{at // 10**6}" for at in _TIMES], [], _TIMES),
    "csv in us since the camera began": (
        [f"{at}" for at in range(0, 400_000, 100_000)],
        [],
        [at * 1000 for at in range(0, 400_000, 100_000)],
    ),
    "csv in ms by its option": (["1", "2", "3", "5"], ["--stamps-in", "ms"], [10**6 * at for at in (1, 2, 3, 5)]),
}


@pytest.mark.parametrize("kind", TABLES)
def test_a_table_of_times_is_read_in_the_unit_that_is_plausible(tmp_path: Path, kind: str) -> None:
    """A date, else a rate that a camera can have, tells the unit."""
    rows, options, expected = TABLES[kind]
    folders = _folders(tmp_path, ["a", "b", "c", "d"])
    head = [row for row in rows if "," in row]
    body = [f"{row},{name}.png" for row, name in zip(rows[len(head) :], "abcd", strict=True)]
    for folder in folders:
        (Path(folder) / "data.csv").write_text("\n".join([*head, *body]))
    assert _imported(tmp_path, [*folders, *options]) == expected


REFUSED: dict[str, tuple[list[str], list[str], str]] = {
    "counted names": (
        ["001", "002", "003"],
        [],
        "have no times: give --times FILE, one time a line, the rate as --fps",
    ),
    "a unit that fits none": ([f"{at}" for at in _TIMES], ["--stamps-in", "ms"], "the times are further apart"),
    "no unit is plausible": (["5", "6", "7"], ["--times"], "does not say in which unit its times are: give it as"),
    "equal times": (["5.5", "5.5", "6.5"], ["--times"], "the times are equal for several images"),
    "times that run backwards": (["5.5", "7.5", "6.5"], ["--times"], "the times run backwards"),
    "no times at all": (["5.5", "x", "6.5"], ["--times"], "'x' is no time"),
    "endless": (["5.5", "inf", "6.5"], ["--times"], "'inf' is no time"),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_times_that_cannot_be_are_refused(tmp_path: Path, kind: str, capsys: pytest.CaptureFixture[str]) -> None:
    """One line says what to give; nothing is written."""
    values, options, words = REFUSED[kind]
    if options == ["--times"]:
        folders = _folders(tmp_path, ["a", "b", "c"])
        (tmp_path / "times.txt").write_text("\n".join(values))
        options = ["--times", str(tmp_path / "times.txt")]
    else:
        folders = _folders(tmp_path, values)
    out = tmp_path / "out.mcap"
    assert main(["sessions", "import", *folders, *options, "--out", str(out)]) == 4
    [line] = capsys.readouterr().err.splitlines()
    assert words in line
    assert not out.exists()


def test_folders_without_images_are_no_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A table that lists none is refused as well."""
    for side in ("left", "right"):
        (tmp_path / side).mkdir()
        (tmp_path / side / "data.csv").write_text("#timestamp [ns],filename\n")
    assert main(["sessions", "import", str(tmp_path), "--out", str(tmp_path / "out.mcap")]) == 4
    assert "holds no images" in capsys.readouterr().err
    assert not (tmp_path / "out.mcap").exists()
