"""Which options of phone-host calibrate were given: what fits no other one is refused, and a live calibration is repeated with them."""

import argparse
import shlex
from dataclasses import dataclass
from typing import Final

from common.errors import SettingsError
from common.places import resolved
from common.program.commandline import ExamplesFirstParser
from phone_host.verbs.calibrate.arguments import add_arguments

_OF_LIVE: Final = frozenset({"link", "camera", "views", "sound", "snapshots", "wait", "tolerance", "keys"})
_OF_IMPORT: Final = frozenset({"unit", "size"})
_WITH_IMPORT: Final = _OF_IMPORT | {"imported", "exports", "board_side", "baseline", "out"}
_OF_ONE_RUN: Final = _OF_LIVE | {"live", "out"}


@dataclass(frozen=True, slots=True)
class _Given:
    """An option as it was given: where argparse keeps it, its name, and all its words."""

    dest: str
    option: str
    words: tuple[str, ...]


def require_pictures(options: argparse.Namespace) -> None:
    """Check that a calibration from pictures has some or takes them, and nothing that belongs to --import or to --live alone.

    Raises:
        SettingsError: they are missing, or an option has no meaning.
    """
    if not options.images and not options.live:
        raise SettingsError(
            "neither pictures nor --live nor --import is given",
            "give LEFT RIGHT --square 25mm, --live --camera URI --square 25mm, or --import FILE",
        )
    for each in _given(options):
        if each.dest in _OF_LIVE and not options.live:
            raise SettingsError(f"{each.option} without --live", "add --live to take the pictures now, or leave it out")
        if each.dest in _OF_IMPORT:
            raise SettingsError(f"{each.option} without --import", "leave it out")


def require_import_alone(options: argparse.Namespace) -> None:
    """Check that nothing is given beside --import that only pictures have.

    Raises:
        SettingsError: an option, or a folder of pictures.
    """
    given = ["pictures"] if options.images else []
    given += [each.option for each in _given(options) if each.dest not in _WITH_IMPORT]
    for option in given:
        raise SettingsError(f"--import and {option} contradict each other", "give pictures of a board, or --import")


def command_again(options: argparse.Namespace, left: str, right: str) -> str:
    """Return the command that calibrates from the pictures of a live calibration as it was done; empty: the earlier calibration holds them now.

    Args:
        options: of the live calibration.
        left: folder of its left pictures.
        right: folder of the right ones.
    """
    if options.earlier is not None and not options.pose_only and resolved(options.earlier) == resolved(options.out):
        return ""
    words = [word for each in _given(options) if each.dest not in _OF_ONE_RUN for word in each.words]
    return shlex.join(["phone-host", "calibrate", left, right, *words, "--out", str(options.out)])


def _given(options: argparse.Namespace) -> list[_Given]:
    """Return the options that are not as they are by default, in the order of --help."""
    parser = ExamplesFirstParser(add_help=False)
    add_arguments(parser)
    found = []
    for action in dict.fromkeys(parser.declared.values()):  # --sound and --no-sound are one
        value = getattr(options, action.dest)
        if value == action.default:
            continue
        name = action.option_strings[-1 if value is False else 0]  # --no-sound
        if isinstance(value, bool):
            words = [name]
        elif action.nargs is None and isinstance(value, list):  # given several times
            words = [word for each in value for word in (name, str(each))]
        else:
            words = [name, *map(str, value if isinstance(value, list) else [value])]
        found.append(_Given(action.dest, name, tuple(words)))
    return found
