"""Check a scan, save it for a slicer, print it: `python examples/print_scan.py MODEL PRINTER`; MODEL is a scan's folder or a mesh, PRINTER an address.

For example `python examples/print_scan.py scan file:scan.gcode` writes the sliced G-code; `octoprint://HOST` in its place prints. It needs a slicer.
"""

import sys

from phone_host.api import Phase, Progress, check_model, export_model, print_model


def told(progress: Progress) -> None:
    """Show how far it is."""
    print(f"{progress.phase.value}: {progress.share:.0%}", file=sys.stderr)


def main(model: str, printer: str) -> int:
    """Print a model if nothing is wrong that would stop it."""
    problems = check_model(model)
    for problem in problems:
        print(f"{'stop' if problem.blocks else 'note'}: {problem.sentence} ({problem.remedy})")
    if any(problem.blocks for problem in problems):
        return 4
    for path in export_model(model, ["stl", "3mf"], "."):
        print(f"saved {path}")
    ended = print_model(model, printer, tell=told)
    print(f"{ended.phase.value} {ended.problem}".strip(), *ended.notes, sep="\n")
    return 0 if ended.phase is Phase.DONE else 3


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
