"""Every link's delays in one run, RFCOMM included: delay-bench in a booted board with two virtual Bluetooth adapters.

`python -m tests.bench.bench_rfcomm [--seconds S]` (images of the board: make test-board). Both programs run in the
guest, whose processor is emulated: compare the rows with each other only, never with another table. The adapters are
btvirt's, with no radio between them: the row shows what RFCOMM, its kernel and our framing cost, without the radio.
NumPy and OpenCV come from this checkout's environment, on a disk attached to the guest.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Final

from tests.bench.machine import machine
from tests.vm.air import AIR, SWITCH_ON
from tests.vm.guest import Guest
from tests.vm.machine import Architecture, image_of

_ROOT: Final = Path(__file__).resolve().parents[2]
_WHEELS: Final = (
    "numpy",
    "numpy.libs",
    "cv2",
    "opencv_python_headless.libs",
    "rich",
    "markdown_it",
    "mdurl",
    "pygments",
)
_SOURCES: Final = ("board_agent", "common", "phone_host")
_GUEST_PYTHON: Final = (3, 11)
"""The version in Debian 12; wheels with native code fit no other."""


def main() -> int:
    """Measure and print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=int, default=10, help="of each run (default 10)")
    options = parser.parse_args()
    image = image_of(Architecture.AMD64)
    if sys.version_info[:2] != _GUEST_PYTHON:
        print("bench_rfcomm was not run: the guest's Python is 3.11, so .venv must be: make venv PYTHON=python3.11")
        return 3
    if not image.built or not shutil.which(image.emulator):
        print("bench_rfcomm was not run: there is no virtual board: make test-board")
        return 3
    print(machine())
    with tempfile.TemporaryDirectory(prefix="bench-") as folder:
        guest = Guest(image, Path(folder), _disk(Path(folder)))
        try:
            guest.start()
            guest.sh(f"mkdir -p /mnt/host && mount -o ro /dev/vdb /mnt/host{AIR}{SWITCH_ON}")
            command = "delay-bench --links tcp,ipc,serial,rfcomm --size 320x240 --fps 5 --matcher block"
            print(f"{command} --seconds {options.seconds}, in the guest:", flush=True)
            running = guest.popen(
                "cd /srv && export PYTHONPATH=/mnt/host && exec python3 -P -m phone_host.bench.cli "
                f"{command.partition(' ')[2]} --seconds {options.seconds} 2>&1"
            )
            with running:
                assert running.stdout is not None
                for line in running.stdout:
                    print(line.decode(errors="replace"), end="", flush=True)
            return running.returncode
        finally:
            guest.stop()


def _disk(folder: Path) -> Path:
    """Write a file system with what the host's program needs besides Debian's packages."""
    content, disk = folder / "content", folder / "disk"
    content.mkdir()
    installed = Path(sys.prefix) / "lib" / f"python{_GUEST_PYTHON[0]}.{_GUEST_PYTHON[1]}" / "site-packages"
    for parent, names in ((installed, _WHEELS), (_ROOT, _SOURCES)):
        for name in names:
            shutil.copytree(parent / name, content / name, ignore=shutil.ignore_patterns("tests", "__pycache__"))
    megabytes = sum(path.stat().st_size for path in content.rglob("*") if path.is_file()) >> 20
    subprocess.run(
        ["mke2fs", "-q", "-t", "ext4", "-O", "^has_journal", "-d", content, disk, f"{megabytes * 5 // 4 + 50}M"],
        check=True,
        stdout=subprocess.DEVNULL,
    )
    shutil.rmtree(content)
    return disk


if __name__ == "__main__":
    sys.exit(main())
