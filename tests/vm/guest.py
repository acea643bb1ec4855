"""A booted board: Debian with its own kernel and systemd in QEMU, reached over ssh, with its link's port on this machine.

Two network cards: eth0 for the test's commands and the webcam, eth1 for the board's link alone, so that a test can degrade the link and
nothing else. The disk image is never changed; what a test writes is gone when the guest stops. Emulated, a boot and an installation take a
minute of processor time: a snapshot of a running guest, its disk and its memory, starts many guests within seconds.
"""

import json
import shlex
import shutil
import socket
import subprocess
import tarfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from tests.support.programs import PATIENCE_S, free_port, until
from tests.vm.clock import ECHO, GuestClock
from tests.vm.machine import COMMAND_LINE, MACHINES, Image, Snapshot

NETWORK_CARD: Final = "eth1"
"""Carries the board's link and nothing else."""

LINK_PORT: Final = 5555
OPEN_TO_ALL: Final = f"tcp://*:{LINK_PORT}?insecure=1"
UNIT: Final = "board-agent"

_BOOT_S: Final = 180.0
"""Boot takes 11 s on an idle machine; 56 s were seen on a busy one."""


class Guest:
    """A virtual board.

    Args:
        start: an image to boot, or a snapshot to go on from.
        folder: for console, pid and ssh's socket.
        disk: an image with a file system of its own, /dev/vdb in the guest; it too is never changed.
        savable: whether it writes to a copy of the image's disk, so that `save` has one.
    """

    def __init__(
        self, start: Image | Snapshot, folder: Path, disk: Path | None = None, *, savable: bool = False
    ) -> None:
        self._image = start if isinstance(start, Image) else start.image
        self._snapshot = start if isinstance(start, Snapshot) else None
        self._disk, self._savable = disk, savable
        self._folder = folder
        self._ssh_port, self.link_port, self.door_port = free_port(), free_port(), free_port()
        self._process: subprocess.Popen[bytes] | None = None
        self._key = folder / "key"

    @property
    def link(self) -> str:
        """The address at which a host on this machine reaches the board's link."""
        return f"tcp://127.0.0.1:{self.link_port}"

    def start(self) -> None:
        """Boot, and wait until the board accepts commands."""
        self._key.write_bytes((self._image.folder / "key").read_bytes())
        self._key.chmod(0o600)
        forwarded = ",".join(
            f"hostfwd=tcp:127.0.0.1:{here}-10.0.3.15:{there}"
            for here, there in ((self.link_port, LINK_PORT), (self.door_port, LINK_PORT + 1))
        )
        network = [
            *("-netdev", f"user,id=orders,net=10.0.2.0/24,hostfwd=tcp:127.0.0.1:{self._ssh_port}-10.0.2.15:22"),
            *("-device", "virtio-net-pci,netdev=orders,romfile="),
            *("-netdev", f"user,id=link,net=10.0.3.0/24,{forwarded}"),
            *("-device", "virtio-net-pci,netdev=link,romfile="),
        ]
        disk = f"id=disk,if=none,format=raw,file={self._root_disk()},snapshot={'off' if self._savable else 'on'},cache=unsafe"
        incoming = ["-incoming", f"exec:cat {shlex.quote(str(self._snapshot.memory))}"] if self._snapshot else []
        machine = MACHINES[self._image.architecture]
        command = [
            *(
                machine.program,
                *machine.arguments,
                "-nodefaults",
                "-no-user-config",
                "-vga",
                "none",
                "-display",
                "none",
            ),
            *("-kernel", str(self._image.folder / "vmlinuz"), "-initrd", str(self._image.folder / "initrd.img")),
            *("-append", f"{machine.command_line} {COMMAND_LINE}"),
            *("-serial", f"file:{self._folder / 'console'}", "-device", "virtio-rng-pci"),
            *("-qmp", f"unix:{self._folder / 'orders'},server=on,wait=off"),
            *("-drive", disk, "-device", "virtio-blk-pci,drive=disk", *_further_disk(self._disk), *network),
            *incoming,
        ]
        with (self._folder / "qemu.log").open("wb") as log:
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=log, stderr=log)
        self._await_boot(after="")

    def _root_disk(self) -> Path:
        """The root file system: of the snapshot, of the image, or a copy of that."""
        if self._snapshot is not None:
            return self._snapshot.disk
        original = self._image.folder / "rootfs.ext4"
        return Path(shutil.copyfile(original, self._folder / "disk")) if self._savable else original

    def save(self) -> Snapshot:
        """Write the guest's memory beside its disk, and stop it; other guests go on from there, as long as its folder is there."""
        memory = self._folder / "memory"
        subprocess.run([*self._ssh_command("")[:-2], "-O", "exit", "root@127.0.0.1"], check=True, capture_output=True)
        self.tell_emulator("migrate", uri=f"exec:cat >{shlex.quote(str(memory))}")
        until(lambda: self.tell_emulator("query-migrate").get("status") == "completed", "the memory is written")
        self.stop()
        return Snapshot(self._image, self._folder / "disk", memory)

    @property
    def emulator_pid(self) -> int:
        """Process id of the emulator on this machine."""
        assert self._process is not None
        return self._process.pid

    @property
    def boot_id(self) -> str:
        """Id of this boot of the guest; empty while the guest cannot be asked."""
        return self._ssh("cat /proc/sys/kernel/random/boot_id").stdout.strip()

    def reboot(self) -> None:
        """Shut down properly, boot again, and wait until the board accepts commands."""
        before = self.boot_id
        self.code("systemctl --no-block reboot")
        self._await_boot(after=before)

    def suspend(self) -> None:
        """Suspend to memory: its CLOCK_MONOTONIC stands still.

        vhci_hcd refuses with a device on its bus, and for a moment after one was pulled. QEMU 7.2 does this correctly only once.
        """
        order = "echo deep >/sys/power/mem_sleep; until echo mem >/sys/power/state; do sleep 0.2; done"
        self.sh(f"systemd-run --quiet --no-block sh -c {shlex.quote(order)}")
        until(lambda: self.tell_emulator("query-status")["status"] == "suspended", "the board sleeps")

    def wake(self) -> None:
        """End the sleep, and wait until the board accepts commands."""
        self.tell_emulator("system_wakeup")
        until(lambda: self.code("true") == 0, "the board is awake")

    def tell_emulator(self, order: str, **arguments: str) -> dict[str, Any]:
        """Send the emulator a command, in QEMU's machine protocol; return its answer."""
        with socket.socket(socket.AF_UNIX) as connection:
            connection.settimeout(PATIENCE_S)
            connection.connect(str(self._folder / "orders"))
            with connection.makefile("rw") as speech:
                speech.readline()  # its greeting
                answer: dict[str, Any] = {}
                for command in ({"execute": "qmp_capabilities"}, {"execute": order, "arguments": arguments}):
                    speech.write(json.dumps(command) + "\n")
                    speech.flush()
                    while "return" not in (answer := json.loads(speech.readline())):
                        assert "event" in answer, answer  # it reports a sleep unasked, too
                return dict(answer["return"])

    def _await_boot(self, after: str) -> None:
        """Wait until systemd has started everything, in a boot other than `after`."""
        deadline = time.monotonic() + _BOOT_S
        while self.boot_id in {"", after}:
            assert self._process is not None
            assert self._process.poll() is None, (self._folder / "qemu.log").read_text()
            assert time.monotonic() < deadline, f"no boot within {_BOOT_S:.0f} s: {self.console[-2000:]}"
            time.sleep(0.3)
        self._ssh("systemctl is-system-running --wait")

    @property
    def console(self) -> str:
        """What the guest's kernel has said so far."""
        return (self._folder / "console").read_text(errors="replace")

    def stop(self) -> None:
        """Pull the plug."""
        if self._process is not None:
            self._process.kill()
            self._process.wait()
            self._process = None

    def sh(self, command: str) -> str:
        """Run a shell command as root; return its output; fails if the command fails."""
        done = self._ssh(command)
        assert done.returncode == 0, f"{command}: exit {done.returncode}\n{done.stdout}{done.stderr}"
        return done.stdout

    def code(self, command: str) -> int:
        """Run a shell command as root; return its exit code."""
        return self._ssh(command).returncode

    def put(self, source: Path, folder: str) -> None:
        """Copy a file or folder into a folder of the guest."""
        receiving = self._ssh_command(f"mkdir -p {shlex.quote(folder)} && tar -x -C {shlex.quote(folder)}")
        with subprocess.Popen(receiving, stdin=subprocess.PIPE, stderr=subprocess.PIPE) as receiver:
            assert receiver.stdin is not None
            with tarfile.open(fileobj=receiver.stdin, mode="w|") as archive:
                archive.add(source, arcname=source.name, filter=_as_root)
            receiver.stdin.close()
            assert receiver.wait(PATIENCE_S) == 0

    def get(self, path: str, target: Path) -> None:
        """Copy a file of the guest to this machine."""
        got = subprocess.run(
            self._ssh_command(f"cat {shlex.quote(path)}"), capture_output=True, check=True, timeout=PATIENCE_S
        )
        target.write_bytes(got.stdout)

    def install(self, package: Path) -> None:
        """Install the board's package."""
        self.put(package, "/var/tmp")
        self.sh(f"dpkg -i /var/tmp/{package.name}")

    def configure(self, camera: str, *links: str, secured: bool = False) -> None:
        """Set the service's camera and links (by default one on every network, open to everybody unless it should be secured), and restart it."""
        links = links or (f"tcp://*:{LINK_PORT}" if secured else OPEN_TO_ALL,)
        edits = (f'camera = "{camera}"', f"link = {json.dumps(links)}")
        script = " ".join(f"-e {shlex.quote(f's|^{edit.split()[0]} = .*|{_literal(edit)}|')}" for edit in edits)
        self.sh(f"sed -i {script} /etc/tandemscan/board-agent.toml")
        assert self.code(f"systemctl restart {UNIT}") == 0, f"{camera}, {links}: {self.journal()[-2000:]}"

    def show(self, name: str, unit: str = UNIT) -> str:
        """Return one property of a unit, such as ActiveState or StatusText."""
        return self.sh(f"systemctl show {unit} -p {name} --value").strip()

    def journal(self, unit: str = UNIT) -> str:
        """Return everything a unit has logged in this boot."""
        return self.sh(f"journalctl -b -u {unit} -o cat --no-pager")

    def until(self, name: str, wanted: str, what: str) -> None:
        """Wait until a property of the service contains a text."""
        deadline = time.monotonic() + PATIENCE_S
        while wanted not in (found := self.show(name)):
            late = (
                f"not within {PATIENCE_S:.0f} s: {what}; {name} is {found!r}, not {wanted!r}\n{self.journal()[-2000:]}"
            )
            assert time.monotonic() < deadline, late
            time.sleep(0.1)

    def write(self, path: str, text: str) -> None:
        """Write a text file in the guest."""
        self.sh(f"printf %s {shlex.quote(text)} > {shlex.quote(path)}")

    def clock(self) -> GuestClock:
        """Open an echo of the guest's CLOCK_MONOTONIC."""
        return GuestClock(self._ssh_command(f"python3 -u -c {shlex.quote(ECHO)}"))

    def popen(self, command: str) -> "subprocess.Popen[bytes]":
        """Start a command that keeps running; the caller ends it."""
        return subprocess.Popen(self._ssh_command(command), stdin=subprocess.PIPE, stdout=subprocess.PIPE)

    @contextmanager
    def forwarded(self, port: int) -> Iterator[int]:
        """Reach a port of the guest's loopback for the length of a block; yields the port on this machine."""
        here = free_port()
        line = ["-N", "-L", f"127.0.0.1:{here}:127.0.0.1:{port}", "-o", "ExitOnForwardFailure=yes", "-S", "none"]
        command = self._ssh_command("")
        with subprocess.Popen([command[0], *line, *command[1:-1]], stdin=subprocess.DEVNULL) as carrier:
            try:
                until(lambda: _is_open(here), "the port is forwarded")
                yield here
            finally:
                carrier.kill()

    def _ssh(self, command: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            self._ssh_command(command),
            capture_output=True,
            text=True,
            check=False,
            stdin=subprocess.DEVNULL,
            timeout=180,
        )

    def _ssh_command(self, command: str) -> list[str]:
        options = (
            "StrictHostKeyChecking=no",
            "UserKnownHostsFile=/dev/null",
            "ConnectTimeout=5",
            "LogLevel=ERROR",
            "ServerAliveInterval=5",
            "ControlMaster=auto",
            f"ControlPath={self._folder}/ssh",
            "ControlPersist=60",
        )
        flags = [word for option in options for word in ("-o", option)]
        return ["ssh", "-F", "none", "-i", str(self._key), "-p", str(self._ssh_port), *flags, "root@127.0.0.1", command]


def _is_open(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def _literal(text: str) -> str:
    """Text as the replacement of sed's `s|…|…|`."""
    return text.replace("&", "\\&")


def _further_disk(image: Path | None) -> list[str]:
    if image is None:
        return []
    return [
        *("-drive", f"id=more,if=none,format=raw,file={image},snapshot=on"),
        *("-device", "virtio-blk-pci,drive=more"),
    ]


def _as_root(member: tarfile.TarInfo) -> tarfile.TarInfo:
    member.uid = member.gid = 0
    member.uname = member.gname = "root"
    member.mode |= 0o444 | (0o111 if member.isdir() else 0)
    return member
