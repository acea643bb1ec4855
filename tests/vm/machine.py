"""The virtual machines: how QEMU emulates a board of each architecture, the images to boot, and snapshots to go on from."""

import subprocess
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import Final

COMMAND_LINE: Final = "quiet loglevel=4 panic=-1 mitigations=off nokaslr selinux=0 apparmor=0 audit=0 random.trust_cpu=on net.ifnames=0 systemd.show_status=0"


class Architecture(Enum):
    """The processor architecture of a board."""

    AMD64 = "amd64"
    ARMHF = "armhf"


@dataclass(frozen=True, slots=True)
class Machine:
    """How QEMU emulates a board of one architecture.

    Attributes:
        program: the emulator.
        arguments: machine, processor, memory.
        command_line: kernel parameters beside COMMAND_LINE.
    """

    program: str
    arguments: tuple[str, ...]
    command_line: str


MACHINES: Final = {
    Architecture.AMD64: Machine(
        "qemu-system-x86_64",
        ("-M", "q35", "-accel", "tcg,thread=multi,tb-size=512", "-cpu", "max", "-smp", "2", "-m", "512"),
        # The HPET counts this machine's nanoseconds. The emulated TSC would be calibrated against it at boot, wrongly on a busy machine.
        # The kernel checks its timer by counting ticks in a loop; on a busy machine too few arrive, and it hangs ("8254 timer not connected").
        "console=ttyS0 clocksource=hpet tsc=unstable no_timer_check",
    ),
    # Memory and processors of a BeagleBone Black; Python is about as fast as there (0.7 s for 10^6 rounds of `x += i`).
    Architecture.ARMHF: Machine(
        "qemu-system-arm",
        ("-M", "virt,highmem=off", "-accel", "tcg,tb-size=256", "-cpu", "cortex-a15", "-smp", "1", "-m", "512"),
        "console=ttyAMA0",
    ),
}


@dataclass(frozen=True, slots=True)
class Image:
    """A guest's files as build-guest leaves them.

    Attributes:
        folder: rootfs.ext4, vmlinuz, initrd.img and key.
        architecture: of the guest.
    """

    folder: Path
    architecture: Architecture = Architecture.AMD64

    @property
    def emulator(self) -> str:
        """The emulator that runs it."""
        return MACHINES[self.architecture].program

    @property
    def built(self) -> bool:
        """Whether all files are there."""
        return all((self.folder / name).is_file() for name in ("rootfs.ext4", "vmlinuz", "initrd.img", "key"))


def image_of(architecture: Architecture) -> Image:
    """The image that .ci/board has built from the current scripts; its folder is named after them, so that a changed script never meets an old image."""
    named = subprocess.run(
        [Path(__file__).resolve().parents[2] / ".ci" / "board", "folder"], capture_output=True, text=True, check=True
    )
    return Image(Path(named.stdout.strip()) / architecture.value, architecture)


@dataclass(frozen=True, slots=True)
class Snapshot:
    """A running guest as `Guest.save` leaves it.

    Attributes:
        image: what it was booted from.
        disk: its disk.
        memory: its memory and devices, as QEMU migrates them.
    """

    image: Image
    disk: Path
    memory: Path
