"""What became of the frames that were to be recorded."""

from dataclasses import dataclass

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
        failure: what ended it early; None: nothing did.
    """

    file: str
    frames: int
    dropped: int
    lost: int
    size_bytes: int
    failure: Trouble | None = None

    @property
    def is_whole(self) -> bool:
        """Whether every image that came is in it."""
        return self.failure is None and not self.dropped

    @property
    def words(self) -> str:
        """For people, one line."""
        missing = [
            f"{count} {why}"
            for count, why in ((self.dropped, "too fast for the disk"), (self.lost, "came after its end"))
            if count
        ]
        told = f"; not in it: {', '.join(missing)}" if missing else ""
        ended = "" if self.failure is None else f"; {self.failure.problem}: {self.failure.remedy}"
        return f"recorded: {self.frames} images, {self.size_bytes / 1e6:.1f} MB in {self.file}{told}{ended}"
