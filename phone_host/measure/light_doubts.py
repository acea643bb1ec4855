"""Judges brightness and sharpness: is a camera covered, in the dark or out of focus? Pure. Figures: decision 0029."""

from typing import Final

from phone_host.measure.trust import Concern, Doubt
from phone_host.model import Exposure

_FLAT: Final = 2.0
_FLAT_RATIO: Final = 5.0
"""An image of less structure, grey levels, shows nothing if it is dark or the other one shows five times as much."""

_DARK_MEAN: Final = 25.0
_DARK_BRIGHT: Final = 50.0
"""An image is dark if its mean and its bright parts are below these levels: a tenth of what a camera's exposure aims at."""

_PLAIN: Final = 5.0
"""Structure, grey levels, below which an image shows nothing but a plain surface. Bare walls in even and uneven light, with noise and
JPEG, have up to 2.8; of 90 given pairs and 60 rendered rooms the plainest has 12.6 in its richer image."""

_BLURRED_PX: Final = 2.0
_BLURRED_RATIO: Final = 1.8
_BLURRED_BESIDE_PX: Final = 1.5
"""Sharp images measure 0.8 to 1.3 px at up to 640 px of width, and 1.8 px if nothing in the scene has a sharp edge."""


def covered_doubts(left: Exposure, right: Exposure) -> tuple[Concern, ...]:
    """Say which camera sees nothing at all; empty if both see something."""
    blind = [
        name
        for name, here, there in (("left", left, right), ("right", right, left))
        if here.structure < _FLAT and (_is_dark(here) or there.structure > max(_FLAT_RATIO * here.structure, _FLAT))
    ]
    if not blind:
        return ()
    camera_sees = _cameras(blind)
    return (
        Concern(Doubt.COVERED, f"{camera_sees} no scene at all", "take off the lens cap, the shutter or the finger"),
    )


def _cameras(names: list[str]) -> str:
    return "both cameras see" if len(names) == 2 else f"the {names[0]} camera sees"


def _is_dark(exposure: Exposure) -> bool:
    return exposure.mean_level < _DARK_MEAN and exposure.bright_level < _DARK_BRIGHT


def dark_doubts(left: Exposure, right: Exposure) -> tuple[Concern, ...]:
    """Say which camera sees almost nothing because it is too dark; empty if neither."""
    dark = [name for name, exposure in (("left", left), ("right", right)) if _is_dark(exposure)]
    if not dark:
        return ()
    level = min(left.mean_level, right.mean_level)
    camera_sees = _cameras(dark)
    return (
        Concern(
            Doubt.DARK,
            f"{camera_sees} almost nothing because it is too dark (mean level {level:.0f} of 255)",
            "switch on a light, or give the camera a longer exposure",
        ),
    )


def is_plain(left: Exposure, right: Exposure) -> bool:
    """Tell whether both images show nothing but a plain surface: what is found in them is noise.

    Args:
        left: the left image.
        right: the right image.
    """
    return max(left.structure, right.structure) < _PLAIN


def unfocused_doubts(left: Exposure, right: Exposure) -> tuple[Concern, ...]:
    """Say which image has no sharp edges; empty if both have."""
    blurred = [
        (name, here.blur_px)
        for name, here, there in (("left", left, right), ("right", right, left))
        if here.blur_px > _BLURRED_PX
        or (here.blur_px > _BLURRED_BESIDE_PX and here.blur_px > _BLURRED_RATIO * there.blur_px)
    ]
    if not blurred:
        return ()
    width = max(blur for _, blur in blurred)
    camera_sees = _cameras([name for name, _ in blurred])
    return (
        Concern(
            Doubt.UNFOCUSED,
            f"{camera_sees} blurred edges ({width:.1f} px)",
            "clean and focus the lens, and switch its autofocus off before you calibrate",
        ),
    )
