"""The versions of all that outlives one process: the package, what board and host say to each other, and the files. Pure; nothing else states one.

They are independent. A number of the wire or of a file goes up when its reader of the version before would misunderstand; how each is met
that is older or newer, decision 0027 says. pyproject.toml and `build-deb` take the package's version from here: a board's package brings no metadata.
"""

from typing import Final

PACKAGE_VERSION: Final = "0.2.0"

PROTOCOL_VERSION: Final = 3
"""2: a camera says whether it can be steered, and `Steer` asks for it. 3: hello and account tell the rung."""

ENROLMENT_VERSION: Final = 2
"""Of the words with which a code is proved. 2: who asks reserves nothing; a proof's first word brings its commitment."""

RIG_FORMAT: Final = 1
"""rig.yaml; a file without `format_version` is of format 1."""

LEDGER_FORMAT: Final = 1
"""delays.jsonl; lines of format 1 do not state it."""

REPORT_FORMAT: Final = 1
"""report.json; a file without `format_version` is of format 1."""


def all_versions() -> str:
    """What `--version` prints, without the line's end."""
    files = {"rig.yaml": RIG_FORMAT, "delays.jsonl": LEDGER_FORMAT, "report.json": REPORT_FORMAT}
    formats = ", ".join(f"{name} {version}" for name, version in files.items())
    return f"tandemscan {PACKAGE_VERSION} (protocol {PROTOCOL_VERSION}, {formats})"


def other_protocol(theirs: int, *, peer: str, own: str) -> tuple[str, str]:
    """Say that a peer speaks another protocol version, and which side to update.

    Args:
        theirs: the peer's version, not ours.
        peer: who that is: `the board`.
        own: who says so: `this host`.

    Returns:
        Problem and remedy, in words for the user.
    """
    older = peer if theirs < PROTOCOL_VERSION else own
    return f"{peer} speaks protocol {theirs}, {own} protocol {PROTOCOL_VERSION}", f"update {older}'s tandemscan"
