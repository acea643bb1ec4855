"""What became of the frames that were to be recorded. Pure."""

from dataclasses import dataclass

from common.words import counted
from phone_host.measure.trouble import Trouble


@dataclass(frozen=True, slots=True, kw_only=True)
class RecordingAccount:
    """The account of one recording.

    Attributes:
        file: its path.
        frames: images in it, of both cameras.
        dropped: images that came faster than the disk takes them.
        lost: images that came after it had ended early.
        size_bytes: how long the file is.
        seconds: how long it lasted.
        left_bytes: room on its disk; None: not known.
        is_over: whether it has ended.
        failure: what ended it early; None: nothing did.
    """

    file: str
    frames: int
    dropped: int
    lost: int
    size_bytes: int
    seconds: float = 0.0
    left_bytes: int | None = None
    is_over: bool = True
    failure: Trouble | None = None

    @property
    def is_whole(self) -> bool:
        """Whether every image that came is in it."""
        return self.failure is None and not self.dropped

    @property
    def words(self) -> str:
        """For people, one line: while it grows what there is and what room is left, then what became of it."""
        return self._ended() if self.is_over else self._growing()

    def _growing(self) -> str:
        minutes, seconds = divmod(int(self.seconds), 60)
        dropped = f", {self.dropped} dropped: the disk is too slow" if self.dropped else ""
        left = "" if self.left_bytes is None else f", {self.left_bytes / 1e9:.1f} GB left"
        told = f"{minutes}:{seconds:02d}, {counted(self.frames, 'image')}, {self.size_bytes / 1e6:.0f} MB"
        return f"recording: {told}{left}{dropped}"

    def _ended(self) -> str:
        missing = [
            f"{count} {why}"
            for count, why in ((self.dropped, "too fast for the disk"), (self.lost, "came after its end"))
            if count
        ]
        told = f"; not in it: {', '.join(missing)}" if missing else ""
        ended = "" if self.frames or self.failure else "; no image came: look at the cameras with phone-host doctor"
        if self.failure is not None:
            ended = f"; {self.failure.problem}: {self.failure.remedy}"
        return f"recorded: {counted(self.frames, 'image')}, {self.size_bytes / 1e6:.1f} MB in {self.file}{told}{ended}"
