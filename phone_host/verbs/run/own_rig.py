"""The rig that a recording holds: a replay computes depth by it, if the user names no other."""

import argparse
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Final

from common.errors import DataError
from common.program.settings import Resolved
from phone_host.declared_settings import PhoneHostSettings
from phone_host.model import Rig
from phone_host.output.rig_yaml import read_rig
from phone_host.recording.playback import Playback

_NAME: Final = "rig.yaml"


def with_own_rig(
    options: argparse.Namespace, found: Resolved[PhoneHostSettings], playback: Playback, tell: Callable[[str], None]
) -> tuple[Resolved[PhoneHostSettings], Rig | None]:
    """Return the settings of a replay with the recording's own rig for its calibration, if there is one of use and no other is given.

    A recording without one, or with one that is damaged or was rejected, can be replayed all the same: pairs and delays only.

    Args:
        options: of `run`.
        found: its settings.
        playback: the recording.
        tell: takes a line that the user should know.

    Returns:
        The settings, and the rig; None: it is not to be taken from the recording.
    """
    content = playback.recorded.attachments.get(_NAME)
    if found.values.calibration or options.rectified or content is None:
        return found, None
    try:
        rig = read_rig(Path(f"{_NAME} in {playback.file}"), bytes(content))
    except DataError as error:
        tell(f"not used: {error.problem}")
        return found, None
    if rig.is_rejected and not options.use_rejected_rig:
        tell(
            f"not used: {_NAME} in {playback.file} was rejected by its own calibration; --use-rejected-rig takes it all the same"
        )
        return found, None
    tell(f"no --calibration: depth is computed by {_NAME} in {playback.file}")
    origins = tuple((name, str(playback.file) if name == "calibration" else origin) for name, origin in found.origins)
    return replace(found, values=replace(found.values, calibration=_NAME), origins=origins), rig
