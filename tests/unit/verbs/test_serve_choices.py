"""What the page is set to: choices as a command line, what is kept of them, and its address."""

import shlex
from dataclasses import fields, replace
from pathlib import Path

import pytest

from common.errors import DataError, SettingsError
from common.program.request import options_of
from phone_host.declared_settings import PhoneHostSettings
from phone_host.jobs.calibrate.request import CalibrateRequest
from phone_host.jobs.run_request import RunRequest
from phone_host.jobs.scan_request import ModelOptions
from phone_host.output.axes import Axes
from phone_host.serve.choices import (
    calibrate_options,
    choices_of,
    options_by_flag,
    page_options,
    request_of,
    shown_words,
    value_schemas,
    with_changes,
    without_depth,
    words_of,
)
from phone_host.serve.commands import Commands
from phone_host.serve.kept_choices import keep, load_choices
from phone_host.serve.page import address_of, page_settings
from tests.support import requests


def test_choices_are_a_command_line_and_back() -> None:
    """Values, switches and several links become words, which the command's own parser reads; and its options become choices."""
    made = with_changes({"far": "5m"}, {"link": "tcp://a:1 tcp://b:2", "rectified": "yes", "far": "", "near": " 300 "})
    assert made == {"link": "tcp://a:1 tcp://b:2", "rectified": "yes", "near": "300"}
    assert words_of(made) == ["--link", "tcp://a:1", "--link", "tcp://b:2", "--rectified", "--near", "300"]
    request = request_of(made, RunRequest)
    assert (request.cameras.link, request.depth.rectified, request.depth.near_m) == (
        ("tcp://a:1", "tcp://b:2"),
        True,
        0.3,
    )
    assert choices_of(request.given) == made
    assert shown_words(made) == words_of(made)
    assert shown_words({"camera": "browser:"}) == ["--camera", "browser:", "--serve"]
    assert with_changes(made, {"rectified": "no"}) == {"link": "tcp://a:1 tcp://b:2", "near": "300"}
    assert words_of({"crop": "-1,0,2,2"}) == ["--crop=-1,0,2,2"]
    assert without_depth(made) == {"link": "tcp://a:1 tcp://b:2"}
    home = str(Path.home())
    assert with_changes({}, {"calibration": "~/r.yaml", "out": " scan "}) == {
        "calibration": f"{home}/r.yaml",
        "out": str(Path("scan").absolute()),
    }


def test_the_page_may_set_what_the_option_tables_say() -> None:
    """Of a run all but what concerns the program; what the settings file may set are options of a run, read alike."""
    assert options_by_flag(RunRequest).keys() - page_options(RunRequest) == {
        "config", "keys", "lan", "log-level", "serve", "wait",
    }  # fmt: skip
    assert set(page_options(ModelOptions)) == {"mat", "object", "voxel", "box", "unseen", "turntable"}
    assert {"live", "import", "export", "from", "snapshots"}.isdisjoint(page_options(CalibrateRequest))
    settings, options = options_of(PhoneHostSettings), options_of(RunRequest)
    assert settings.keys() == {item.name for item in fields(PhoneHostSettings)}
    for name, setting in settings.items():
        assert replace(options[name], group="", often=False) == setting
    asked = {"set": page_options(RunRequest), "calibrate": calibrate_options(), "scan": page_options(ModelOptions)}
    # Camera and link are chosen for a run.
    assert calibrate_options().keys() == {"board", "square", "baseline", "views", "out"}
    for do, taken in asked.items():
        assert value_schemas()[f"{do}_values"]["properties"].keys() == taken.keys()  # type: ignore[index]


@pytest.mark.parametrize(
    ("kind", "verb", "name"), [(CalibrateRequest, "calibrate", "views"), (RunRequest, "run", "pairs")]
)
def test_a_value_is_refused_in_the_words_of_its_command(kind: type, verb: str, name: str) -> None:
    """The remedy names the command that has the option."""
    with pytest.raises(SettingsError, match=f"--{name} is 'x'.*phone-host {verb} --help"):
        request_of({name: "x"}, kind, verb)


@pytest.mark.parametrize(
    "changes", [{"colour": "red"}, {"config": "x"}, {"json": "yes"}, {"serve": ":1"}, {"rectified": "perhaps"}]
)
def test_what_is_no_option_of_a_run_cannot_be_set(changes: dict[str, str]) -> None:
    """Unknown names, options of the program itself, and a switch that is neither on nor off."""
    with pytest.raises(SettingsError):
        with_changes({}, changes)


def test_choices_are_kept_as_settings_and_beside_them(tmp_path: Path) -> None:
    """Settings become keys that `run --config` reads, other options a table of the page; keys of the program are not the page's."""
    file = tmp_path / "new" / "host.toml"
    assert load_choices(file) == ({}, {})
    choices = {"link": "tcp://a:1", "tolerance": "5ms", "interpolate": "yes", "near": "300"}
    keep(file, choices)
    assert file.stat().st_mode & 0o777 == 0o600
    file.write_text('keys = "k"  # mine\n' + file.read_text())
    assert load_choices(file) == ({**choices, "tolerance": "5.0"}, {"keys": "k"})
    keep(file, {"near": "200"})
    assert file.read_text() == 'keys = "k"  # mine\n\n[page]\nnear = "200"\n'
    keep(file, {"near": "200"})
    (tmp_path / "folder").touch()
    with pytest.raises(SettingsError):
        keep(tmp_path / "folder" / "host.toml", choices)


def test_a_choice_is_kept_beside_one_that_another_hand_spoiled(tmp_path: Path) -> None:
    """A value in the file that no run would take does not keep the page from keeping another."""
    file = tmp_path / "host.toml"
    file.write_text('[page]\nnear = "1"\n')
    keep(file, {"camera": "replay:y"}, {"camera": "replay:x"})
    assert load_choices(file) == ({"camera": "replay:y", "near": "1"}, {})


def test_the_command_of_a_scan_has_the_choices_that_scan_takes(tmp_path: Path) -> None:
    """Options that only `run` has are left out, the folder of the results is one of its own, and `scan` takes all of it; there is none for a browser's camera."""
    commands = Commands(tmp_path / "host.toml", str(tmp_path / "keys"), lambda _: None)
    cameras = {"link": "tcp://10.0.0.2:5555", "camera": "v4l2:/dev/video0"}
    line = commands.scan_command({**cameras, "calibration": "my rig.yaml", "near": "300", "fifo": "4", "out": "there"})
    words = shlex.split(line)
    assert (Path(words[0]).name, words[1]) == ("phone-host", "scan")
    request = requests.request_of(*words[1:])
    link, camera, keys = request.cameras.link, request.cameras.camera, request.cameras.keys
    assert (link, camera, request.depth.calibration, request.out, keys) == (
        (cameras["link"],), cameras["camera"], "my rig.yaml", Path("there/scan"), str(tmp_path / "keys"),
    )  # fmt: skip
    assert "--fifo" not in line
    assert commands.scan_command({"camera": cameras["camera"]}) == ""
    assert commands.scan_command({**cameras, "camera": "browser:"}) == ""


def test_what_is_set_is_checked_as_on_the_command_line(tmp_path: Path) -> None:
    """A bad number, a rig that is none, contradicting limits and limits without depth are refused; a password is not shown, and its place holder changes nothing."""
    commands = Commands(tmp_path / "host.toml", str(tmp_path / "keys"), lambda _: None)
    refused: tuple[dict[str, str], ...] = (
        {"pairs": "many"},
        {"calibration": str(tmp_path)},
        {"near": "9m", "far": "1m", "rectified": "yes"},
        {"link": "x:y"},
        {"near": "300"},
    )
    for changes in refused:
        with pytest.raises((SettingsError, DataError)):
            commands.changed({}, changes)
    secret = {"camera": "http://me:secret@10.0.0.2:8080/video"}
    shown = commands.shown(secret)
    assert "secret" not in shown["camera"] + commands.command(secret)
    assert commands.changed(secret, {**shown, "pairs": "300"}) == {**secret, "pairs": "300"}
    assert commands.command({"near": "300"}).endswith(f"run --keys {tmp_path}/keys --near 300")
    assert commands.snapshots({"out": "scan", "axes": "y-up"}) == (Path("scan/snapshots"), Axes.Y_UP)


@pytest.mark.parametrize(
    ("text", "there"),
    [
        (None, ("127.0.0.1", 8765)),
        ("", ("127.0.0.1", 8765)),
        ("localhost:9000", ("localhost", 9000)),
        (":9000", ("127.0.0.1", 9000)),
        ("9000", ("127.0.0.1", 9000)),
        ("localhost", ("localhost", 8765)),
        ("[::1]:80", ("::1", 80)),
        ("[::1]", ("::1", 8765)),
    ],
)
def test_an_address_may_leave_out_what_is_usual(text: str | None, there: tuple[str, int]) -> None:
    """Host, port or both."""
    assert address_of(text) == there


def test_an_address_that_is_none_or_that_others_reach_is_refused(tmp_path: Path) -> None:
    """A port beyond all ports, and anything but loopback without https."""
    for text in ("localhost:99999", "localhost:x"):
        with pytest.raises(SettingsError, match="address"):
            address_of(text)
    with pytest.raises(SettingsError) as refused:
        page_settings("0.0.0.0:8765", tmp_path)
    assert "--lan" in refused.value.remedy
    assert not (tmp_path / "page-token").exists()
