"""Settings: each source overrides the one before, and mistakes are reported with their place."""

import json
import logging
from dataclasses import dataclass
from pathlib import Path

import pytest

from common.errors import SettingsError
from common.program.request import setting
from common.program.settings import listing, log_level, resolve, with_origins


@dataclass(frozen=True, slots=True)
class Sample:
    """One setting of each type."""

    name: str = setting("default", "a text")
    depth: int = setting(1, "a whole number")
    tolerance: float = setting(0.5, "a number")
    loop_forever: bool = setting(False, "a truth value")  # noqa: FBT003 - stands for a default
    links: tuple[str, ...] = setting(("a", "b"), "texts")


IN_FILE = {"name": '"file"', "depth": "2", "tolerance": "2", "loop_forever": "true", "links": '["file"]'}
IN_ENVIRONMENT = {"name": "variable", "depth": "3", "tolerance": "3.5", "loop_forever": "0", "links": "x y"}
IN_OPTIONS: dict[str, object] = {
    "name": "option",
    "depth": 4,
    "tolerance": 4.5,
    "loop_forever": True,
    "links": ("option",),
}
VALUES: dict[str, tuple[object, object, object]] = {
    "name": ("default", "file", "variable"),
    "depth": (1, 2, 3),
    "tolerance": (0.5, 2.0, 3.5),
    "loop_forever": (False, True, False),
    "links": (("a", "b"), ("file",), ("x", "y")),
}


@pytest.mark.parametrize("field", VALUES)
@pytest.mark.parametrize("origins", range(8))
def test_the_strongest_origin_wins_and_is_named(
    field: str, origins: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Default < file < environment < option, in every combination; the other settings keep their default."""
    file = tmp_path / "board.toml"
    expected, origin = VALUES[field][0], "default"
    if origins & 1:
        file.write_text(f"{field} = {IN_FILE[field]}\n", encoding="utf-8")
        expected, origin = VALUES[field][1], str(file)
    if origins & 2:
        monkeypatch.setenv(f"SAMPLE_{field.upper()}", IN_ENVIRONMENT[field])
        expected, origin = VALUES[field][2], f"SAMPLE_{field.upper()}"
    options: dict[str, object] = dict.fromkeys(VALUES)
    if origins & 4:
        options[field] = expected = IN_OPTIONS[field]
        origin = f"--{field.replace('_', '-')}"
    resolved = resolve(Sample, "SAMPLE", file if origins & 1 else None, options)
    value = getattr(resolved.values, field)
    assert (value, type(value)) == (expected, type(expected))
    assert [name for name, _ in resolved.origins] == list(VALUES)
    assert dict(resolved.origins) == dict.fromkeys(VALUES, "default") | {field: origin}


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("depht = 2", "depht"),
        ('depth = "2"', "depth"),
        ("depth = 2.0", "depth"),
        ("depth = true", "depth"),
        ("name = 1", "name"),
        ('tolerance = "1"', "tolerance"),
        ("tolerance = true", "tolerance"),
        ("loop_forever = 1", "loop_forever"),
        ('links = "a"', "links"),
        ('links = ["a", 1]', "links"),
        ("[name]\nfirst = 1", "name"),
        ("depth = ", "line 1"),
        ("depth = 1\ndepth = 2", "line 2"),
    ],
)
def test_mistakes_in_the_file_name_key_and_file(line: str, named: str, tmp_path: Path) -> None:
    """An unknown key, a wrong type or broken TOML gives one line with the file's name and the key or line in it."""
    file = tmp_path / "board.toml"
    file.write_text(line + "\n", encoding="utf-8")
    with pytest.raises(SettingsError) as caught:
        resolve(Sample, "SAMPLE", file, {})
    assert named in str(caught.value)
    assert "board.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_stronger_origin_does_not_hide_a_mistake_in_the_file(tmp_path: Path) -> None:
    """A wrong value in the file is reported even if an option overrides it."""
    file = tmp_path / "board.toml"
    file.write_text('depth = "2"\n', encoding="utf-8")
    with pytest.raises(SettingsError, match="depth"):
        resolve(Sample, "SAMPLE", file, {"depth": 3})


@pytest.mark.parametrize(
    ("field", "text"), [("DEPTH", "two"), ("DEPTH", ""), ("DEPTH", "1.5"), ("TOLERANCE", "x"), ("LOOP_FOREVER", "yes!")]
)
def test_mistakes_in_the_environment_name_the_variable(field: str, text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A value that is not of the setting's type is reported with its variable."""
    monkeypatch.setenv(f"SAMPLE_{field}", text)
    with pytest.raises(SettingsError, match=f"SAMPLE_{field}"):
        resolve(Sample, "SAMPLE", None, {})


@pytest.mark.parametrize("content", [None, b"\xff\xfe"])
def test_an_unreadable_file_is_named(content: bytes | None, tmp_path: Path) -> None:
    """A file that is missing or not UTF-8 is reported by name, and so is a folder in its place."""
    file = tmp_path / "board.toml"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(SettingsError, match=r"board\.toml"):
        resolve(Sample, "SAMPLE", file, {})
    with pytest.raises(SettingsError, match=tmp_path.name):
        resolve(Sample, "SAMPLE", tmp_path, {})


def test_the_listing_has_straight_columns_whatever_the_names_and_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """Values and origins are aligned in one column each, even beside an overlong value, and lists are joined by blanks."""
    monkeypatch.setenv("SAMPLE_NAME", "x" * 60)
    lines = listing(resolve(Sample, "SAMPLE", None, {"depth": 4}), as_json=False).splitlines()
    assert [line.split()[0] for line in lines] == list(VALUES)
    starts = {line.rindex(line.split()[-1]) for line in lines}
    assert starts == {len("loop_forever") + 2 + 60 + 2}
    assert {line.index(value) for line, value in zip(lines, ("xxx", "4", "0.5", "False", "a b"), strict=True)} == {14}
    assert lines[1].endswith(" --depth")


def test_the_listing_as_json_keeps_types(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each name maps to its value, of the right type, and its origin."""
    monkeypatch.setenv("SAMPLE_DEPTH", "3")
    shown = json.loads(listing(resolve(Sample, "SAMPLE", None, {}), as_json=True))
    assert shown["depth"] == {"value": 3, "origin": "SAMPLE_DEPTH"}
    assert shown["links"] == {"value": ["a", "b"], "origin": "default"}


def test_log_levels_go_by_name() -> None:
    """The four names are accepted in any case; others are refused by name."""
    assert log_level("Warning") == logging.WARNING
    with pytest.raises(SettingsError, match="loud"):
        log_level("loud")


def test_a_run_is_saved_with_the_origin_of_each_setting(tmp_path: Path) -> None:
    """Settings keep their origin; other options show whether they were given, even abbreviated; paths are saved as text."""
    resolved = resolve(Sample, "NOBODY_SETS_THIS", None, {"depth": 4})
    options = {"name": None, "out": tmp_path, "save_every": 3, "pairs": 0, "wait": 2.5}
    words = ["phone-host", "run", "--out", str(tmp_path), "--save=3", "--wait", "2.5", "--pairs-of-nothing"]
    found = with_origins(resolved, options, words)
    assert {name: item["origin"] for name, item in found.items()} == {
        "name": "default", "depth": "--depth", "tolerance": "default", "loop_forever": "default", "links": "default",
        "out": "--out", "save_every": "--save-every", "pairs": "default", "wait": "--wait",
    }  # fmt: skip
    assert json.loads(json.dumps(found))["out"]["value"] == str(tmp_path)


def test_a_line_that_is_not_toml_is_shown_without_its_password(tmp_path: Path) -> None:
    """The error has the line's number and text, as one line of limited length; what stands before an @ in an address is left out."""
    file = tmp_path / "sample.toml"
    file.write_text('depth = 2\nname = http://me:secret@phone:8080/video\x07\nlinks = ["a"]\n' + "# end\n" * 3)
    with pytest.raises(SettingsError) as caught:
        resolve(Sample, "SAMPLE", file, {})
    assert "line 2, 'name = http://...@phone:8080/video" in str(caught.value)
    assert "secret" not in str(caught.value)
    assert str(caught.value).isprintable()
    file.write_text("depth = 2\nname = " + "x" * 1000)
    with pytest.raises(SettingsError) as caught:
        resolve(Sample, "SAMPLE", file, {})
    assert len(str(caught.value)) < 300 + len(str(file))


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("depth = " + "[" * 5000, "beyond all measure"),
        ("depth = " + "1" * 5000, "beyond all measure"),
        ("a." * 20_000 + "a = 1", "has 20000 dots in line 1"),
        ("depth = 1\n" * 10_000, "are the most"),
    ],
)
def test_a_hostile_file_costs_one_line(tmp_path: Path, text: str, said: str) -> None:
    """Lists in lists, endless numbers and keys of thousands of parts are refused at once."""
    file = tmp_path / "sample.toml"
    file.write_text(text)
    with pytest.raises(SettingsError) as caught:
        resolve(Sample, "SAMPLE", file, {})
    assert said in str(caught.value)
    assert len(str(caught.value)) < 300 + len(str(file))
