"""How easily README, help and messages read: `python -m tests.docs.readability [REVISION ...]` compares today's text with earlier revisions.

Measures words per sentence and the share of sentences in the passive voice (a form of "to be" and a participle). Both
are rough: they compare two texts of one kind but do not grade a single text.
"""

import re
import subprocess
import sys
import tarfile
import tempfile
from io import BytesIO
from pathlib import Path
from typing import Final

from rich.console import Console
from rich.table import Table

from tests.docs.message_texts import Code
from tests.docs.troubleshooting import messages

_ROOT: Final = Path(__file__).parents[2]
_PASSIVE: Final = re.compile(
    r"\b(?:is|are|was|were|be|been|being|gets?)\s+(?:\w+ly\s+|not\s+|no longer\s+)?"
    r"(?:\w+ed|given|taken|told|known|shown|found|made|kept|seen|read|written|let|put|held|left|lost|sent|cut|said|begun|done|built|brought)\b"
)
_HELP: Final = """
import contextlib, importlib, io
for name, verbs in (("phone_host.cli", ("run", "calibrate", "calibrate-time", "stereo", "quality", "demo", "doctor", "pair", "keys")), ("board_agent.cli", ("run", "keys", "pair"))):
    for verb in verbs:
        out = io.StringIO()
        with contextlib.redirect_stdout(out):
            importlib.import_module(name).main([verb, "--help"])
        print(out.getvalue().split("options:")[-1])
"""


def sentences(text: str) -> list[str]:
    """Split prose into sentences: at full stops, at colons and semicolons that end a clause, and at the end of a table cell."""
    plain = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    plain = re.sub(r"^ {4}.*$|!\[[^\]]*\]\([^)]*\)", "", plain, flags=re.MULTILINE)
    plain = re.sub(r"`[^`\n]*`", " X ", plain)
    found = re.split(r"[.!?:;](?:\s|$)|\||\n\s*\n|\n(?=\s*[-#|])", plain)
    return [
        item for item in (" ".join(re.findall(r"[A-Za-z][\w'-]*", part)) for part in found) if len(item.split()) > 2
    ]


def measure(text: str) -> tuple[int, float, float]:
    """Sentences, words per sentence, share in the passive voice."""
    all_of_them = sentences(text)
    words = sum(len(item.split()) for item in all_of_them)
    passive = sum(bool(_PASSIVE.search(item)) for item in all_of_them)
    return len(all_of_them), words / max(1, len(all_of_them)), passive / max(1, len(all_of_them))


def texts(root: Path) -> dict[str, str]:
    """The texts that a user reads, by kind."""
    packages = [
        path for name in ("common", "board_agent", "phone_host") for path in sorted((root / name).rglob("*.py"))
    ]
    told = [text for _, problems, remedies in messages(Code(packages)) for text in (*problems, *remedies)]
    shown = subprocess.run(
        [sys.executable, "-P", "-c", _HELP],
        cwd=root,
        env={"PYTHONPATH": str(root), "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=True,
    )
    options = re.sub(r"\n\s{10,}", " ", shown.stdout)
    return {
        "README": (root / "README.md").read_text(encoding="utf-8"),
        "help": "\n\n".join(re.findall(r"\s{2,}(\S.*)$", options, re.MULTILINE)),
        "messages": "\n\n".join(told),
    }


def main(revisions: list[str]) -> None:
    """Print the table."""
    table = Table()
    for title in ("text", "revision", "sentences", "words per sentence", "passive"):
        table.add_column(title)
    with tempfile.TemporaryDirectory() as name:
        for revision in (*revisions, ""):
            root = _ROOT
            if revision:
                root = Path(name) / revision
                packed = subprocess.run(["git", "archive", revision], cwd=_ROOT, capture_output=True, check=True).stdout
                with tarfile.open(fileobj=BytesIO(packed)) as archive:
                    archive.extractall(root, filter="data")
            for kind, text in texts(root).items():
                count, words, passive = measure(text)
                table.add_row(kind, revision or "now", str(count), f"{words:.1f}", f"{passive:.0%}")
    Console().print(table)


if __name__ == "__main__":
    main(sys.argv[1:])
