"""Groups of options that several requests share. Light."""

from dataclasses import dataclass
from typing import Final

from common.orientation import Flip, Orientation
from common.program.quantities import seconds
from common.program.request import option, option_of
from phone_host.declared_settings import LINK_HELP, PhoneHostSettings

PAIRED: Final = (
    "two files, two folders or two globs; images of folders and globs are paired by the number in the name, else by equal names,"
    " else in name order. Or a recording, FILE.mcap: its stillest pair of each second, at most a hundred, written to DIR/views"
)
"""How LEFT and RIGHT are given, for the verbs that take pairs of images."""

LAN_HELP: Final = "serve the page to other machines: by https with a certificate authority of this machine's own, and only with the token of the first address"
_WAIT_HELP: Final = "seconds to wait for a board, then exit with code 3 (default: wait for ever{})"


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraOptions:
    """Which board and which camera pairs come from."""

    link: tuple[str, ...] | None = option_of(PhoneHostSettings, "link", often=True)
    camera: str | None = option_of(PhoneHostSettings, "camera", often=True)
    wait_s: float | None = option("--wait", page=False, number=seconds, metavar="S", help=_WAIT_HELP.format(""))
    keys: str | None = option_of(PhoneHostSettings, "keys")


@dataclass(frozen=True, slots=True, kw_only=True)
class OneLinkOptions(CameraOptions):
    """The same, with one link."""

    link: str | None = option("--link", often=True, metavar="URI", help=LINK_HELP)  # type: ignore[assignment]  # one in place of several


@dataclass(frozen=True, slots=True, kw_only=True)
class PairOptions(CameraOptions):
    """The same, and when two frames are a pair."""

    tolerance_ms: float | None = option_of(PhoneHostSettings, "tolerance")


@dataclass(frozen=True, slots=True, kw_only=True)
class RunCameraOptions(PairOptions):
    """The same, for `run`, which may have a time limit."""

    wait_s: float | None = option(
        "--wait", page=False, number=seconds, metavar="S", help=_WAIT_HELP.format("; with --seconds S, S + 10 seconds")
    )


def _flip(side: str) -> Flip:
    mirror = f"mirror the {side} images, after turning them: h exchanges left and right, v top and bottom"
    return option(  # type: ignore[no-any-return]
        f"--flip-{side}",
        page=False,
        read=lambda text, _: Flip(text),
        choices=(Flip.H.value, Flip.V.value),
        default=Flip.NONE.value,
        help=mirror,
    )


def _rotate(side: str) -> int:
    turn = f"turn the {side} images clockwise by so many degrees: their camera is mounted turned"
    return option(f"--rotate-{side}", page=False, type=int, choices=(90, 180, 270), default=0, help=turn)  # type: ignore[no-any-return]


@dataclass(frozen=True, slots=True, kw_only=True)
class ImageOptions:
    """How image files are read, turned and mirrored."""

    rotate_left: int = _rotate("left")
    rotate_right: int = _rotate("right")
    flip_left: Flip = _flip("left")
    flip_right: Flip = _flip("right")
    max_megapixels: int | None = option_of(PhoneHostSettings, "max_megapixels")

    @property
    def mounted(self) -> tuple[Orientation, Orientation]:
        """How the left and the right images are turned upright, after what their EXIF headers say."""
        return Orientation(self.rotate_left, self.flip_left), Orientation(self.rotate_right, self.flip_right)
