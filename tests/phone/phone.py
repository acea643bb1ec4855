"""A stand-in for a phone: aarch64 programs under qemu-user in a file system laid out as Termux's, where nothing else may be written.

What it cannot show: Bionic, Android's own limits on system calls, Termux's packages, a camera, Wi-Fi. docs/phone.md has the check-list for
a real phone.
"""

import os
import re
import shutil
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from packaging.requirements import Requirement

ROOT: Final = Path(__file__).resolve().parents[2]
_HERE: Final = Path(__file__).resolve().parent
_UID: Final = 10123
"""An app's user on Android: u0_a123."""

_ANDROID: Final = {
    "sys_platform": "android",
    "platform_system": "Android",
    "platform_machine": "aarch64",
    "python_version": "3.14",
    "python_full_version": "3.14.0",
}

PATIENCE_S: Final = 2400.0
"""Installing and compiling take minutes each, emulated, and more on a busy machine."""


def image() -> Path:
    """The file system that .ci/phone builds; it may be missing."""
    named = subprocess.run([ROOT / ".ci" / "phone", "folder"], capture_output=True, text=True, check=True)
    return Path(named.stdout.strip())


class Phone:
    """One phone, with the checkout in its home folder and nothing installed.

    Args:
        tree: the system.
        files: a new folder for what Termux may write.
    """

    def __init__(self, tree: Path, files: Path) -> None:
        self._tree, self._files = tree, files
        self.prefix, self.home = files / "usr", files / "home"
        self._lay_out(tree)
        self.checkout = self.home / "tandemscan"
        self.checkout.mkdir(parents=True)
        listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, check=True).stdout
        packed = ["tar", "--create", "--null", "--files-from=-", "--ignore-failed-read"]
        with subprocess.Popen(packed, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as packing:
            assert packing.stdin is not None
            packing.stdin.write(listed)
            packing.stdin.close()
            subprocess.run(["tar", "--extract", "--no-same-owner"], cwd=self.checkout, stdin=packing.stdout, check=True)
        _fetch_wheels(files / "wheels")
        for path in [files, *files.rglob("*")]:
            os.chown(path, _UID, _UID, follow_symlinks=False)

    def run(self, command: str) -> "subprocess.CompletedProcess[str]":
        """Run a shell command in the checkout, to its end."""
        return subprocess.run(
            self._entered(command),
            capture_output=True,
            text=True,
            check=False,
            timeout=PATIENCE_S,
            stdin=subprocess.DEVNULL,
        )

    @contextmanager
    def running(self, command: str, log: Path) -> Iterator["subprocess.Popen[bytes]"]:
        """Run a shell command in the checkout while the block lasts; all its processes end with it.

        Args:
            command: the command.
            log: takes what it prints.
        """
        with log.open("wb") as out:
            process = subprocess.Popen(self._entered(command), stdin=subprocess.DEVNULL, stdout=out, stderr=out)
        try:
            yield process
        finally:
            if process.poll() is None:
                # The child that `unshare --kill-child` is to take along has changed its user since, which ends that promise (prctl(2)).
                for child in Path(f"/proc/{process.pid}/task/{process.pid}/children").read_text().split():
                    os.kill(int(child), signal.SIGKILL)
            process.kill()
            process.wait()

    def calls(self) -> list[str]:
        """The calls of Termux's programs up to now."""
        path = self.prefix / "var" / "calls"
        return path.read_text().splitlines() if path.exists() else []

    def _entered(self, command: str) -> list[str]:
        shell = ["/data/data/com.termux/files/usr/bin/sh", "-c", f"cd ~/tandemscan && {command}"]
        spaces = ["unshare", "--mount", "--pid", "--fork", "--kill-child"]
        return [*spaces, str(_HERE / "enter"), str(self._tree), str(self._files), *shell]

    def _lay_out(self, tree: Path) -> None:
        """Termux's folders. All programs but compilers and services are there from the start, as links into the system."""
        version = (tree / "etc" / "python-version").read_text().strip()
        for folder in ("bin", "lib", "tmp", "var/log"):
            (self.prefix / folder).mkdir(parents=True)
        later = ("clang", "gcc", "cc", "c++", "sv", "runsv")
        for program in (tree / "usr" / "bin").iterdir():
            if not program.name.startswith(later):
                (self.prefix / "bin" / program.name).symlink_to(f"/usr/bin/{program.name}")
        (self.prefix / "bin" / "python").symlink_to("python3")
        for name in (version, "python3"):
            (self.prefix / "lib" / name).symlink_to(f"/usr/lib/{name}")
        for program in (_HERE / "termux" / "bin").iterdir():
            (self.prefix / "bin" / program.name).unlink(missing_ok=True)
            shutil.copy(program, self.prefix / "bin")
        shutil.copytree(_HERE / "termux" / "services", self.prefix / "stand-in")


def _fetch_wheels(folder: Path) -> None:
    """Fetch what Termux's pip would: the pinned packages that Android needs, as wheels for glibc. In the emulator, TLS alone would take minutes."""
    text = (ROOT / "requirements" / "run.txt").read_text()
    blocks = re.split(r"\n(?=[a-z])", text.strip())
    needed = [block for block in blocks if _is_for_android(block.partition(" \\")[0])]
    folder.mkdir()
    pins = folder / "pins.txt"
    pins.write_text("\n".join(re.sub(r" ;.*", " \\\\", block, count=1) for block in needed) + "\n")
    tags = [
        word
        for tag in ("manylinux_2_28", "manylinux_2_17", "manylinux2014")
        for word in ("--platform", f"{tag}_aarch64")
    ]
    wanted = [
        "--require-hashes",
        "--no-deps",
        "--only-binary=:all:",
        "--python-version=3.14",
        *tags,
        "--requirement",
        str(pins),
    ]
    subprocess.run([sys.executable, "-m", "pip", "download", "--quiet", *wanted, "--dest", str(folder)], check=True)


def _is_for_android(requirement: str) -> bool:
    marker = Requirement(requirement).marker
    return marker is None or marker.evaluate({**_ANDROID, "extra": ""})


def interrupt(process: "subprocess.Popen[bytes]", *words: str) -> None:
    """Send SIGINT to those of a command's processes whose command line has one of the words, as Ctrl-C does in its terminal."""
    for pid in _descendants(process.pid):
        line = Path(f"/proc/{pid}/cmdline").read_bytes().decode(errors="replace")
        # Not the shell that is this stand-in's first process: the kernel lets nobody interrupt that one.
        if any(word in line for word in words) and "\0-c\0" not in line:
            os.kill(pid, signal.SIGINT)


def _descendants(pid: int) -> Iterator[int]:
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in (task / "children").read_text().split():
            yield int(child)
            yield from _descendants(int(child))
