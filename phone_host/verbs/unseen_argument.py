"""The option that says what becomes of surface that no view measured. Light."""

import argparse
from typing import Final

UNSEEN_HELP: Final = "surface that no view measured: fill it in with colours from its border, fill it in pink, or cut it, which leaves the surface open"


def add_unseen_argument(
    parser: argparse.ArgumentParser, when: str = "", *, default: str | None, otherwise: str
) -> None:
    """Declare --unseen.

    Args:
        parser: of the verb.
        when: begins the help text, such as "with --box: ".
        default: its value where it is not given.
        otherwise: what is done then, for the help text.
    """
    parser.add_argument(
        "--unseen",
        choices=("fill", "pink", "cut"),  # of `model.unseen.UnseenSurface`, which is not light
        default=default,
        help=f"{when}{UNSEEN_HELP} ({otherwise})",
    )
