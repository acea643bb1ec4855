"""What to do with a scan that is written: the commands at the end of its page and of its summary."""

from pathlib import Path

from common.program.invocation import command_line
from phone_host.model import UnseenSurface
from phone_host.report.page_links import NextCommand
from phone_host.report.scan_report import ScanReport


def next_commands(report: ScanReport, out: Path) -> tuple[NextCommand, ...]:
    """Return the commands that export and print the model; none if it has no surface."""
    if not report.model.triangles:
        return ()
    export = (
        NextCommand(
            "Export the model, for other programs and slicers",
            command_line("phone-host", "export", out, "--to", "stl,3mf,glb", "--out", out / "export"),
        ),
    )
    if report.unseen is UnseenSurface.CUT and report.model.unseen_share > 0:  # it is open, and cannot be printed
        return export
    return (
        *export,
        NextCommand("Check whether it can be printed", command_line("phone-host", "printcheck", out)),
        NextCommand("Find a 3D printer, and print it", command_line("phone-host", "print", "--find")),
    )


def next_lines(report: ScanReport, out: Path) -> list[str]:
    """Say on a terminal what to do next."""
    commands = next_commands(report, out)
    return ["try next", *(f"  {each.command}" for each in commands)] if commands else []
