"""The options that say which board and which camera pairs come from, shared by the verbs that stream. Light."""

import argparse

from common.camera.options import TURNED
from common.program.quantities import milliseconds, reading, seconds
from phone_host.camera.examples import EXAMPLE


def add_source_arguments(
    parser: argparse.ArgumentParser, when: str = "", *, several: bool = True, waiting: str = "wait for ever"
) -> None:
    """Declare --link, --camera, --wait and --keys.

    Args:
        parser: of the verb.
        when: begins each help text, if the verb takes them in some cases only, such as "for --live: ".
        several: whether --link may be repeated.
        waiting: how long a board is waited for by default.
    """
    forms = "tcp://HOST:PORT, ipc://PATH[?owner=USER], serial:DEVICE or rfcomm://DEVICE"
    again = "; repeat the option: the frames come over the best link that is up" if several else ""
    parser.add_argument(
        "--link",
        action="append" if several else "store",
        metavar="URI",
        help=f"{when}address of the board: {forms} (default: look for a board){again}",
    )
    parser.add_argument("--camera", metavar="URI", help=f"{when}camera of this machine: {EXAMPLE}; {TURNED}")
    parser.add_argument(
        "--wait",
        type=reading(seconds, "--wait"),
        metavar="S",
        help=f"{when}seconds to wait for a board, then exit with code 3 (default: {waiting})",
    )
    parser.add_argument("--keys", metavar="DIR", help=f"{when}folder of keys (default ~/.config/tandemscan)")


def add_tolerance_argument(parser: argparse.ArgumentParser, when: str = "") -> None:
    """Declare --tolerance.

    Args:
        parser: of the verb.
        when: begins the help text, as in `add_source_arguments`.
    """
    parser.add_argument(
        "--tolerance",
        type=reading(milliseconds, "--tolerance"),
        metavar="MS",
        help=f"{when}greatest difference of the two exposure times in a pair (default: half of the longer frame period)",
    )
