"""Printed commands can be pasted: a program is named as the user's shell finds it."""

import os
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[4]

_PROGRAM = """#!/bin/sh
echo {name} of this installation $*
"""

_ASKED = f"""import sys
sys.path.insert(0, {str(ROOT)!r})
from common.program import invocation
print(getattr(invocation, sys.argv[1])(*sys.argv[2:]), end="")
"""
"""A program of the installation, which says what it calls itself and the others."""


class Installation:
    """A folder with a Python and two programs that say who they are, but no board-agent.

    Args:
        folder: an empty folder.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        for name in ("phone-host", "delay-bench"):
            program(folder / name, _PROGRAM.format(name=name))
        (folder / "asked.py").write_text(_ASKED)
        (folder / "python3").symlink_to(sys.executable)

    def says(self, function: str, *arguments: str, path: str = "/usr/bin:/bin", cwd: Path = Path("/usr")) -> str:
        """Start a program of it by its path, with a search path and in a folder; return what it calls a program."""
        command = [str(self.folder / "python3"), str(self.folder / "asked.py"), function, *arguments]
        environment = {**os.environ, "PATH": path}
        return subprocess.run(command, env=environment, cwd=cwd, capture_output=True, text=True, check=True).stdout


def program(path: Path, text: str) -> None:
    """Write a program."""
    path.write_text(text)
    path.chmod(0o755)


@pytest.fixture
def installation(tmp_path: Path) -> Installation:
    """An installation in a folder whose name has a space."""
    folder = tmp_path / "my tools" / "bin"
    folder.mkdir(parents=True)
    return Installation(folder)


def pasted(line: str, folder: Path) -> str:
    """What a shell says to the line."""
    return subprocess.run(["/bin/sh", "-c", line], cwd=folder, capture_output=True, text=True, check=True).stdout


def test_a_program_on_the_path_has_its_bare_name(installation: Installation) -> None:
    """Directly or by a link, as pipx makes them."""
    assert installation.says("program_name", "phone-host", path=f"/usr/bin:{installation.folder}") == "phone-host"
    links = installation.folder.parent / "links"
    links.mkdir()
    (links / "phone-host").symlink_to(installation.folder / "phone-host")
    assert installation.says("program_name", "phone-host", path=f"{links}:/usr/bin") == "phone-host"


def test_a_program_that_is_not_on_the_path_has_a_path_that_works(installation: Installation) -> None:
    """Pasted from anywhere it starts this installation's program, though the folder's name has a space."""
    line = installation.says("command_line", "delay-bench", "--out", "my bench")
    assert pasted(line, Path("/")) == "delay-bench of this installation --out my bench\n"
    assert shlex.split(line)[0] == str(installation.folder / "delay-bench")


def test_another_installations_program_is_not_meant(installation: Installation) -> None:
    """If the shell would start another program of that name, the path is given."""
    other = installation.folder.parent / "other"
    other.mkdir()
    program(other / "phone-host", "#!/bin/sh\necho another\n")
    assert "this installation" in pasted(installation.says("program_name", "phone-host", path=str(other)), Path("/"))


def test_below_the_current_folder_the_path_is_short(installation: Installation) -> None:
    """As the user typed it."""
    above = installation.folder.parent
    name = installation.says("program_name", "phone-host", cwd=above)
    assert name == "bin/phone-host"
    assert "this installation" in pasted(name, above)


def test_a_program_of_another_machine_keeps_its_name(installation: Installation) -> None:
    """This installation has no board-agent."""
    for function in ("program_name", "sudo_name"):
        assert installation.says(function, "board-agent") == "board-agent"


def test_sudo_gets_the_whole_path(installation: Installation) -> None:
    """After sudo the whole path stands: it does not look in a virtual environment, even when the shell does."""
    name = installation.says("sudo_name", "phone-host", path=str(installation.folder))
    assert shlex.split(name) == [str(installation.folder / "phone-host")]


def test_only_commands_in_a_text_are_changed(installation: Installation) -> None:
    """Names inside sentences and arguments stay."""
    text = (
        "phone-host makes depth.\n\n  phone-host demo\n  PHONE_HOST_FIFO=2:block phone-host settings\n"
        "  sudo phone-host pair --udev\n  phone-host run --config phone-host.toml\n  board-agent run\n"
    )
    whole = shlex.quote(str(installation.folder / "phone-host"))
    assert installation.says("as_found", text, cwd=installation.folder) == (
        "phone-host makes depth.\n\n  phone-host demo\n  PHONE_HOST_FIFO=2:block phone-host settings\n".replace(
            " phone-host", " ./phone-host"
        )
        + f"  sudo {whole} pair --udev\n  ./phone-host run --config phone-host.toml\n  board-agent run\n"
    )
