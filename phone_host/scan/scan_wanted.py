"""What the user asks of a scan. Pure."""

import math
from dataclasses import dataclass, field

from common.errors import SettingsError
from phone_host.model import UnseenSurface
from phone_host.scan.blocks import Box
from phone_host.scan.closing import Floor
from phone_host.scan.field_bytes import KeptField
from phone_host.scan.loop_closing import LoopSettings
from phone_host.scan.mat import ABOVE_M, Mat


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanWanted:
    """What the user asked for.

    Attributes:
        voxel_m: distance of two values of the field, m; NaN: as the depths' noise deserves.
        most_bytes: memory of the model at most.
        box: what lies outside does not belong to the model, and what nobody saw inside is closed; None: everything belongs, and nothing is closed.
        threads: that compute; results do not depend on them.
        mat: on which the object lies: it alone tells where each pair was taken; None: there is none.
        turntable: whether the cameras stand still and an object turns before them.
        on_table: whether a thing is scanned that stands on a table, without a mat.
        onto: the field of an earlier pass, to which this one is added; None: this one is alone.
        unseen: what files hold of the part of a closed surface that no view measured.
        loops: how loops are closed where nothing but the camera's way tells where it is; None: they are not.
    """

    voxel_m: float = math.nan
    most_bytes: int = 300_000_000
    box: Box | None = None
    threads: int = 1
    mat: Mat | None = None
    turntable: bool = False
    on_table: bool = False
    onto: KeptField | None = None
    unseen: UnseenSurface = UnseenSurface.FILL
    loops: LoopSettings | None = field(default_factory=LoopSettings)

    def __post_init__(self) -> None:
        """Refuse what contradicts itself.

        Raises:
            SettingsError: so it is.
        """
        ways = {"mat": self.mat is not None, "turntable": self.turntable, "on_table": self.on_table}
        asked = [name for name, is_asked in ways.items() if is_asked]
        if len(asked) > 1:
            raise SettingsError(f"{asked[1]} beside {asked[0]}", "ask for one of mat, turntable and on_table")
        if self.onto is not None and not self.turntable:
            raise SettingsError("onto without turntable", "scan both passes with turntable=True")

    @property
    def model_box(self) -> Box | None:
        """What lies outside does not belong to the model: the box that was asked for, or the room above the mat; None: everything belongs."""
        return self.mat.room if self.box is None and self.mat is not None else self.box

    @property
    def floor(self) -> Floor | None:
        """The plane on which the thing stands: the mat, or the table; None: it is not known."""
        return (
            None if self.mat is None and not self.on_table else Floor(skip_m=ABOVE_M, is_printed=self.mat is not None)
        )
