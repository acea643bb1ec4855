"""No printer, but a file for one: what `--printer file:OUT.gcode` means."""

from collections.abc import Callable
from pathlib import Path

from common.byte_order_mark import without_mark
from common.errors import SettingsError, UnavailableError
from phone_host.output.atomic import write_bytes
from phone_host.printers.door import Job, Wishes
from phone_host.printers.host_commands import passed_note
from phone_host.printers.progress import Ended, Phase, Progress

_HOT = "its G-code leaves heaters on: the printer stays hot at the end"


class FileDoor:
    """See PrinterDoor.

    Args:
        path: of the file; there must be none yet.
    """

    leaving_s = 0.0

    def __init__(self, path: Path) -> None:
        self._path = path

    def require_ready(self) -> None:
        """See PrinterDoor."""
        if self._path.exists():
            raise SettingsError(f"{self._path} exists", "give a new name, or remove it")
        if not self._path.parent.is_dir():
            raise SettingsError(f"{self._path.parent} is no folder", "make it, or give another name")

    def send(self, job: Job, wishes: Wishes, tell: Callable[[Progress], None]) -> Ended:
        """See PrinterDoor."""
        del wishes
        self.require_ready()
        tell(Progress(phase=Phase.SENDING))
        try:
            write_bytes(self._path, without_mark(job.gcode.read_bytes()))
        except OSError as error:
            raise UnavailableError(
                f"{self._path} cannot be written ({error.strerror})", "make room on the disk, or give another name"
            ) from None
        notes = (_HOT,) * job.facts.leaves_hot + passed_note(job.facts.host_commands, "whoever prints the file")
        return Ended(phase=Phase.DONE, share=1.0, notes=notes)
