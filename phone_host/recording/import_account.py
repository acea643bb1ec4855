"""What became of another program's images that were taken into a recording. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from common.recording.mcap_records import Damage


@dataclass(frozen=True, slots=True)
class ImportAccount:
    """What was imported.

    Attributes:
        images: how many images each side has.
        remarks: what was used instead of times that cannot be true, in words.
        unused: why a topic is not used, by topic.
        damages: where something is missing in the source.
    """

    images: Mapping[str, int]
    remarks: tuple[str, ...] = ()
    unused: Mapping[str, str] = field(default_factory=dict)
    damages: tuple[Damage, ...] = ()
