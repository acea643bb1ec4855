"""What the station does with choices: those of the file at its start, and those that several pages make at once."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from common.diagnostic import Diagnostic, Severity
from common.errors import SettingsError
from phone_host.serve.commands import Commands
from phone_host.serve.kept_choices import load_choices
from phone_host.serve.station import Station
from phone_host.web.source import Command, Do
from tests.support.pictures import jpeg


def test_what_the_file_says_is_checked_at_the_start(tmp_path: Path) -> None:
    """A name that is no option is refused with its file; a value that is none is told by the page until it is mended."""
    file, keys = tmp_path / "host.toml", str(tmp_path / "keys")
    file.write_text('[page]\nbanana = "1"\n')
    with pytest.raises(SettingsError, match=r"host\.toml: 'banana' is no option"):
        Commands(file, keys, lambda _: None)
    file.write_text('camera = "replay:"\n')
    station = Station(Commands(file, keys, lambda _: None))
    assert station.state().trouble == Diagnostic(
        "camera 'replay:' names no folder", "name one with images, for example replay:frames?fps=30", Severity.FAIL
    )
    refused = station.command(Command(do=Do.SET, values={"pairs": "3"})).trouble
    assert refused == station.state().trouble
    missing = station.command(Command(do=Do.SET, values={"camera": f"replay:{tmp_path}/nope"})).trouble
    assert missing == Diagnostic(
        f"replay '{tmp_path}/nope' does not exist", "give a folder of images, an image or a quoted glob", Severity.FAIL
    )
    (tmp_path / "frames").mkdir()
    (tmp_path / "frames" / "0.jpg").write_bytes(jpeg(32, 24, seed=1))
    assert station.command(Command(do=Do.SET, values={"camera": f"replay:{tmp_path}/frames"})).trouble is None
    assert station.state().trouble is None
    assert f'camera = "replay:{tmp_path}/frames"' in file.read_text()


def test_what_is_set_at_the_same_moment_is_all_kept(tmp_path: Path) -> None:
    """Several pages may set several things at once: none takes another's back, in memory or in the file."""
    file = tmp_path / "host.toml"
    station = Station(Commands(file, str(tmp_path / "keys"), lambda _: None))
    wanted = {"pairs": "3", "seconds": "4", "save-every": "5", "tolerance": "6", "budget": "30ms", "axes": "y-up"}
    setting = [Command(do=Do.SET, values={name: value}) for name, value in wanted.items()]
    with ThreadPoolExecutor(len(setting)) as threads:
        assert {answer.words for answer in threads.map(station.command, setting)} == {"set"}
    assert station.state().settings == wanted
    assert load_choices(file)[0].keys() == wanted.keys()
