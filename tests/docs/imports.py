"""Draws docs/imports.svg, who imports whom in `phone_host`: `python -m tests.docs.imports`. Needs Graphviz (`apt install graphviz`).

Rooms are nodes; edges that others imply are left out.
"""

import re
import subprocess
import sys
from pathlib import Path
from typing import Final

_ROOT: Final = Path(__file__).parents[2]
_PACKAGE: Final = _ROOT / "phone_host"
PICTURE: Final = _ROOT / "docs" / "imports.svg"
_IMPORT: Final = re.compile(r"^\s*(?:from|import) phone_host(?:\.(\w+)| import (\w+))", re.MULTILINE)
_LEFT_OUT: Final = frozenset({"__init__", "start"})
"""`start` is the process's first line; it imports `cli` alone."""

_STYLE: Final = (
    'rankdir=TB; ranksep=0.5; nodesep=0.15; node [shape=box, style="rounded,filled", fillcolor="#dbeafe", color="#9aa5b1",'
    ' fontname="sans-serif", fontsize=11]; edge [color="#7b8794", arrowsize=0.6];'
)


def rooms() -> dict[str, frozenset[str]]:
    """Return what each room of `phone_host` imports of the others."""
    found: dict[str, set[str]] = {}
    for path in sorted(_PACKAGE.rglob("*.py")):
        room = path.relative_to(_PACKAGE).parts[0].removesuffix(".py")
        if room not in _LEFT_OUT:
            named = {a or b for a, b in _IMPORT.findall(path.read_text(encoding="utf-8"))}
            found.setdefault(room, set()).update(named - {room})
    return {room: frozenset(others & found.keys()) for room, others in found.items()}


def reduced(graph: dict[str, frozenset[str]]) -> dict[str, frozenset[str]]:
    """Return the graph without edges that others imply.

    Args:
        graph: without cycles.
    """

    def reached(room: str) -> frozenset[str]:
        return frozenset().union(*({other} | reached(other) for other in graph[room]))

    return {
        room: frozenset(one for one in others if not any(one in reached(other) for other in others - {one}))
        for room, others in graph.items()
    }


def main() -> int:
    """Draw the picture."""
    lines = [
        f'"{room}";' + "".join(f' "{room}" -> "{other}";' for other in sorted(others))
        for room, others in sorted(reduced(rooms()).items())
    ]
    graph = "\n".join(("digraph imports {", _STYLE, *lines, "}"))
    drawn = subprocess.run(("dot", "-Tsvg"), input=graph, capture_output=True, text=True, check=True).stdout
    PICTURE.write_text(drawn, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
