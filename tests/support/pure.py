"""Which modules are pure, as the import contracts in pyproject.toml list them."""

import tomllib
from pathlib import Path
from typing import Final

ROOT: Final = Path(__file__).resolve().parents[2]
_CONTRACT: Final = "pure modules: no I/O, no threads, no clock"


def pure_modules() -> dict[str, Path]:
    """Every pure module by name, with its file; for a listed package, everything in it."""
    linter = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    [listed] = [contract["source_modules"] for contract in linter["contracts"] if contract["name"] == _CONTRACT]
    found = {}
    for name in listed:
        path = ROOT.joinpath(*name.split("."))
        for file in sorted(path.rglob("*.py")) if path.is_dir() else [path.with_suffix(".py")]:
            parts = file.relative_to(ROOT).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found
