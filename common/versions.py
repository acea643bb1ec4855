"""The versions of everything that outlives one process: the package, the protocols between board and host, and the files. Pure.

No other module states a version. The versions are independent. A wire or file version goes up when readers of the previous version would
misunderstand the data. Decision 0027 says how older and newer versions are handled. pyproject.toml and `build-deb` take the package's version
from here, because a board's package carries no metadata.
"""

from typing import Final

PACKAGE_VERSION: Final = "0.2.0"

PROTOCOL_VERSION: Final = 3
"""2: a camera says whether it can be steered, and `Steer` asks for it. 3: hello and account state the rung."""

ENROLMENT_VERSION: Final = 2
"""Version of the words that prove a code. 2: asking reserves nothing; a proof's first word carries its commitment."""

RIG_FORMAT: Final = 3
"""rig.yaml; a file without `format_version` is of format 1. 2: lenses, covariance, views. 3: views name their board, and are as seen."""

LEDGER_FORMAT: Final = 1
"""delays.jsonl; lines of format 1 do not state it."""

REPORT_FORMAT: Final = 1
"""report.json; a file without `format_version` is of format 1."""

CAMERAS_FORMAT: Final = 1
"""cameras.json."""

OVERLAY_FORMAT: Final = 1
"""overlay.yaml."""

CAPTURE_FORMAT: Final = 1
"""capture.json."""


def all_versions() -> str:
    """What `--version` prints, without the newline."""
    files = {
        "rig.yaml": RIG_FORMAT,
        "delays.jsonl": LEDGER_FORMAT,
        "report.json": REPORT_FORMAT,
        "cameras.json": CAMERAS_FORMAT,
        "overlay.yaml": OVERLAY_FORMAT,
        "capture.json": CAPTURE_FORMAT,
    }
    formats = ", ".join(f"{name} {version}" for name, version in files.items())
    return f"tandemscan {PACKAGE_VERSION} (protocol {PROTOCOL_VERSION}, {formats})"


def other_protocol(theirs: int, *, peer: str, own: str) -> tuple[str, str]:
    """Say that a peer speaks another protocol version, and which side to update.

    Args:
        theirs: the peer's version, not ours.
        peer: who the peer is, for example `the board`.
        own: who reports it, for example `this host`.

    Returns:
        Problem and remedy, worded for the user.
    """
    older = peer if theirs < PROTOCOL_VERSION else own
    return f"{peer} speaks protocol {theirs}, {own} protocol {PROTOCOL_VERSION}", f"update {older}'s tandemscan"
