"""What a terminal shows of a recording while it grows: images, size, and the space that is left on its disk."""

import os
from pathlib import Path

from phone_host.measure.recording_account import RecordingAccount


def recording_words(account: RecordingAccount) -> str:
    """Return one line."""
    if account.failure is not None:
        return account.words
    said = f"recording: {account.frames} images, {account.size_bytes / 1e6:.0f} MB"
    dropped = f", {account.dropped} dropped: the disk is too slow" if account.dropped else ""
    try:
        disk = os.statvfs(Path(account.file).parent)
    except OSError:
        return said + dropped
    return f"{said}, {disk.f_bavail * disk.f_frsize / 1e9:.1f} GB left{dropped}"
