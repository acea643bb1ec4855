"""Printed commands can be pasted: a program is named as the user's shell finds it."""

import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from common.program.invocation import as_found, command_line, program_name, sudo_name


@pytest.fixture
def installation(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two programs that say who they are; phone-host was started from it, by its path."""
    folder = tmp_path / "my tools" / "bin"
    folder.mkdir(parents=True)
    for name in ("phone-host", "delay-bench"):
        (folder / name).write_text(f"#!/bin/sh\necho {name} of this installation $*\n")
        (folder / name).chmod(0o755)
    monkeypatch.setattr(sys, "argv", [str(folder / "phone-host")])
    monkeypatch.setattr(sys, "executable", str(tmp_path / "none" / "python3"))
    monkeypatch.setenv("PATH", "/usr/bin:/bin")
    monkeypatch.chdir("/usr")
    return folder


def pasted(line: str, folder: Path) -> str:
    """What a shell says to the line."""
    return subprocess.run(["/bin/sh", "-c", line], cwd=folder, capture_output=True, text=True, check=True).stdout


def test_a_program_on_the_path_has_its_bare_name(installation: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Directly or by a link, as pipx makes them."""
    monkeypatch.setenv("PATH", f"/usr/bin:{installation}")
    assert program_name("phone-host") == "phone-host"
    links = installation.parent / "links"
    links.mkdir()
    (links / "phone-host").symlink_to(installation / "phone-host")
    monkeypatch.setenv("PATH", f"{links}:/usr/bin")
    assert program_name("phone-host") == "phone-host"


def test_a_program_that_is_not_on_the_path_has_a_path_that_works(installation: Path) -> None:
    """Pasted from anywhere it starts this installation's program, though the folder's name has a space."""
    line = command_line("delay-bench", "--out", "my bench")
    assert pasted(line, Path("/")) == "delay-bench of this installation --out my bench\n"
    assert shlex.split(line)[0] == str(installation / "delay-bench")


def test_another_installations_program_is_not_meant(installation: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """If the shell would start another program of that name, the path is given."""
    other = installation.parent / "other"
    other.mkdir()
    (other / "phone-host").write_text("#!/bin/sh\necho another\n")
    (other / "phone-host").chmod(0o755)
    monkeypatch.setenv("PATH", str(other))
    assert "this installation" in pasted(program_name("phone-host"), Path("/"))


def test_below_the_current_folder_the_path_is_short(installation: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As the user typed it."""
    monkeypatch.chdir(installation.parent)
    assert program_name("phone-host") == "bin/phone-host"
    assert "this installation" in pasted(program_name("phone-host"), installation.parent)


def test_a_program_of_another_machine_keeps_its_name(installation: Path) -> None:
    """This installation has no board-agent."""
    assert not (installation / "board-agent").exists()
    assert program_name("board-agent") == sudo_name("board-agent") == "board-agent"


def test_sudo_gets_the_whole_path(installation: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """After sudo the whole path stands: it does not look in a virtual environment, even when the shell does."""
    monkeypatch.setenv("PATH", str(installation))
    assert shlex.split(sudo_name("phone-host")) == [str(installation / "phone-host")]


def test_only_commands_in_a_text_are_changed(installation: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Names inside sentences and arguments stay."""
    monkeypatch.chdir(installation)
    text = (
        "phone-host makes depth.\n\n  phone-host demo\n  PHONE_HOST_FIFO=2:block phone-host settings\n"
        "  sudo phone-host pair --udev\n  phone-host run --config phone-host.toml\n  board-agent run\n"
    )
    whole = shlex.quote(str(installation / "phone-host"))
    assert as_found(text) == (
        "phone-host makes depth.\n\n  phone-host demo\n  PHONE_HOST_FIFO=2:block phone-host settings\n".replace(
            " phone-host", " ./phone-host"
        )
        + f"  sudo {whole} pair --udev\n  ./phone-host run --config phone-host.toml\n  board-agent run\n"
    )
