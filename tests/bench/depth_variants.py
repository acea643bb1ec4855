"""Chooses constants of `tandem` with each scene held out: `python -m tests.bench.depth_variants [NAME=V,V,V ...] [--help]`.

A constant is any enumerator of the C sources (phone_host/native/src) that is set in one place: STEP_COST (P1),
JUMP_COST (P2), SPECKLE_AREA, WARM_UP, ISLAND, ... The sources are copied to build/variants, the values are put in, and
each variant is built into a library of its own with the product's flags; nothing of the product is changed. Libraries
are kept there, by the digest of their sources. COST_CAP + JUMP_COST must stay below 85, or sums of paths overflow.

By default one constant is varied at a time, the others as they are; `--grid` tries every combination. The table
(depth_choice) tells for each scene what the others choose, how that scores on it, and what would have been best on it; then
the variants by their score on all scenes. Cases: those of bench_accuracy, but the boards.
"""

import argparse
import importlib.util
import itertools
import os
import re
import shutil
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Final

from phone_host.native import build_library
from phone_host.native.library import Library, Simd, load, native
from phone_host.native.library import required as required_library
from phone_host.stereo.match_tandem import TandemMatcher
from tests.bench.depth_accuracy import MakeMatcher, room_cases, scene_cases
from tests.bench.depth_choice import leave_one_out

FOLDER: Final = Path("build/variants")
USUAL: Final = ("STEP_COST=9,11,13", "JUMP_COST=36,40,44", "SPECKLE_AREA=20,30,60")

Values = Mapping[str, int]
"""Constants by name."""


class VariantError(Exception):
    """A constant cannot be varied; the text says which and why."""


def _places(name: str, sources: Path) -> list[tuple[Path, re.Match[str]]]:
    setting = re.compile(rf"\b{re.escape(name)} = ([^,/}}\n]+?)(?=\s*(?:,|/\*|\n|}}))")
    found = ((path, setting.finditer(path.read_text(encoding="utf-8"))) for path in sorted(sources.glob("*.[ch]")))
    return [(path, match) for path, matches in found for match in matches]


def current(name: str, sources: Path = build_library.SOURCES) -> int:
    """The value of a constant in the sources.

    Raises:
        VariantError: it is not set, set in several places, or set to something that is no number.
    """
    places = _places(name, sources)
    if len(places) != 1:
        raise VariantError(f"{name} is set in {len(places)} places of {sources}; it must be one")
    text = places[0][1][1]
    if not re.fullmatch(r"-?\d+", text):
        raise VariantError(f"{name} is {text}, which is no plain number")
    return int(text)


def with_values(values: Values, folder: Path) -> ModuleType:
    """Copy the sources of the library with other values.

    Args:
        values: to put in.
        folder: where they go; a copy that is there is removed.

    Returns:
        The copy's own `build_library`, which builds just these sources, for plain C and the widest set of this processor.

    Raises:
        VariantError: a constant cannot be varied.
    """
    shutil.rmtree(folder, ignore_errors=True)
    (folder / "src").mkdir(parents=True)
    for path in build_library.SOURCES.glob("*.[ch]"):
        shutil.copy(path, folder / "src")
    for name, value in values.items():
        current(name, folder / "src")
        ((path, match),) = _places(name, folder / "src")
        text = path.read_text(encoding="utf-8")
        path.write_text(f"{text[: match.start(1)]}{value}{text[match.end(1) :]}", encoding="utf-8")
    shutil.copy(str(build_library.__file__), folder)
    spec = importlib.util.spec_from_file_location("build_variant", folder / "build_library.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module  # dataclasses look their module up there
    spec.loader.exec_module(module)
    best = required_library(native()).simd
    wanted = {Simd.SCALAR.value, best.value}
    inside = vars(module)
    inside["_BY_MACRO"] = tuple(
        (macro, tuple(isa for isa in sets if isa.name in wanted)) for macro, sets in inside["_BY_MACRO"]
    )
    return module


def library_of(values: Values, folder: Path = FOLDER) -> Library:
    """The library with other values; built, if it was not before.

    Raises:
        VariantError: a constant cannot be varied.
        BuildError: it cannot be built; also another copy's class of that name.
    """
    module = with_values(values, folder / "sources")
    place = folder / module.sources_digest()
    if not (place / build_library.LIBRARY_FILE).exists():
        place.mkdir(parents=True, exist_ok=True)
        module.build(place)
    return required_library(load(place.resolve()))


def variants_of(choices: Mapping[str, Sequence[int]], *, grid: bool) -> dict[str, Values]:
    """The variants to compare, by name; "as it is" is one of them.

    Args:
        choices: the values of each constant.
        grid: every combination; otherwise one constant at a time.

    Raises:
        VariantError: a constant cannot be varied.
    """
    now = {name: current(name) for name in choices}
    if grid:
        settings = [dict(zip(choices, values, strict=True)) for values in itertools.product(*choices.values())]
    else:
        settings = [{**now, name: value} for name, values in choices.items() for value in values]
    variants: dict[str, Values] = {"as it is": now}
    for values in settings:
        changed = {name: value for name, value in values.items() if value != now[name]}
        if changed:
            variants[", ".join(f"{name} {value}" for name, value in changed.items())] = values
    return variants


def _parsed(text: str) -> tuple[str, list[int]]:
    name, _, values = text.partition("=")
    try:
        return name, [int(value) for value in values.split(",")]
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"{text!r}: give NAME=VALUE,VALUE,...") from error


def main() -> int:
    """Build, match, print; exit code 2 when a constant cannot be varied."""
    parser = argparse.ArgumentParser(
        "python -m tests.bench.depth_variants",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("choices", nargs="*", type=_parsed, metavar="NAME=V,V", help=f"(default: {' '.join(USUAL)})")
    parser.add_argument("--grid", action="store_true", help="every combination, not one constant at a time")
    parser.add_argument("--only", default="", help="cases whose name contains this")
    parser.add_argument("--no-rooms", action="store_true", help="without the rendered rooms")
    options = parser.parse_args()
    scenes = scene_cases() if os.environ.get("SCAN_DATA") else ()
    cases = [case for case in (*scenes, *(() if options.no_rooms else room_cases())) if options.only in case.name]
    if len({case.scene for case in cases}) < 2:
        print("error: two scenes at least are needed; SCAN_DATA names the folder of real images", file=sys.stderr)
        return 2
    try:
        variants = variants_of(dict(options.choices or map(_parsed, USUAL)), grid=options.grid)
    except VariantError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    makers: dict[str, MakeMatcher | str] = {}
    for number, (name, values) in enumerate(variants.items(), 1):
        print(f"variant {number} of {len(variants)}: {name}", file=sys.stderr, flush=True)
        library = library_of(values)
        makers[name] = lambda count, library=library: TandemMatcher(count, library)  # type: ignore[misc]
    now = ", ".join(f"{name} {value}" for name, value in variants["as it is"].items())
    print(f"as it is: {now}; {len(cases)} cases\n{leave_one_out(makers, cases)}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
