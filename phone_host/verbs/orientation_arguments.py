"""The options that say how image files are read, turned and mirrored, shared by the verbs that read pairs of them. Light."""

import argparse

from common.orientation import Flip, Orientation
from phone_host.declared_settings import MAX_MEGAPIXELS_HELP

_TURNS = (90, 180, 270)


def add_orientation_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare --rotate-left, --rotate-right, --flip-left and --flip-right."""
    for side in ("left", "right"):
        parser.add_argument(
            f"--rotate-{side}",
            type=int,
            choices=_TURNS,
            default=0,
            help=f"turn the {side} images clockwise by so many degrees: their camera is mounted turned",
        )
    for side in ("left", "right"):
        parser.add_argument(
            f"--flip-{side}",
            choices=(Flip.H.value, Flip.V.value),
            default=Flip.NONE.value,
            help=f"mirror the {side} images, after turning them: h exchanges left and right, v top and bottom",
        )


def add_image_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare those, and --max-megapixels."""
    add_orientation_arguments(parser)
    parser.add_argument("--max-megapixels", type=int, metavar="N", help=MAX_MEGAPIXELS_HELP)


def orientations(options: argparse.Namespace) -> tuple[Orientation, Orientation]:
    """Return how the left and the right images are turned upright, after what their EXIF headers say.

    Args:
        options: options as `add_orientation_arguments` declares them.
    """
    return (
        Orientation(options.rotate_left, Flip(options.flip_left)),
        Orientation(options.rotate_right, Flip(options.flip_right)),
    )
