"""Termux's scripts as far as any machine can tell: shells read them, and elsewhere they end in one line. `make test-arm` runs them to their end."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

HERE = Path(__file__).resolve().parents[3]
SCRIPTS = sorted((HERE / "deploy" / "host").glob("*.sh"))
PHONE = HERE / "tests" / "phone"
ALL = [
    *SCRIPTS,
    HERE / ".ci" / "phone",
    PHONE / "build-phone",
    PHONE / "enter",
    *sorted((PHONE / "termux" / "bin").iterdir()),
]


def _run(script: str, *options: str) -> "subprocess.CompletedProcess[str]":
    environment = {name: text for name, text in os.environ.items() if name != "PREFIX"}
    command = ["sh", str(HERE / "deploy" / "host" / script), *options]
    return subprocess.run(command, capture_output=True, text=True, check=False, env=environment)


@pytest.mark.parametrize("reader", [("bash", "-n"), ("dash", "-n"), ("shellcheck",)], ids=" ".join)
def test_every_shell_can_read_them(reader: tuple[str, ...]) -> None:
    """Bash and dash find no fault in the syntax, and shellcheck none at all."""
    if shutil.which(reader[0]) is None:
        pytest.skip(f"{reader[0]} is not installed")
    assert len(SCRIPTS) == 2
    for script in ALL:
        done = subprocess.run([*reader, script], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize(
    ("script", "options", "code", "words"),
    [
        ("termux-install.sh", (), 3, "error: this is not Termux: on a laptop: make run-venv"),
        (
            "termux-install.sh",
            ("--colour",),
            2,
            "error: --colour is no option: give --no-compiler, --service or --no-service",
        ),
    ],
)
def test_elsewhere_they_end_in_one_line(script: str, options: tuple[str, ...], code: int, words: str) -> None:
    """Outside Termux, or with an option that is none, a script changes nothing and says what to do."""
    done = _run(script, *options)
    assert (done.returncode, done.stderr) == (code, f"{words}\n")


def test_help_names_every_option() -> None:
    """--help says what the script does and lists its options."""
    shown = _run("termux-install.sh", "--help").stdout
    assert all(option in shown for option in ("--no-compiler", "--service", "--no-service"))


def test_opencvs_types_are_for_the_type_checker_alone() -> None:
    """`cv2.typing` comes with OpenCV's wheels only; Termux's package lacks it, so every mention is a quoted one."""
    files = [file for top in ("board_agent", "common", "phone_host") for file in (HERE / top).rglob("*.py")]
    bare = [file.name for file in files if re.search(r"(?<![\"`])\bcv2\.typing", file.read_text(encoding="utf-8"))]
    assert bare == []
