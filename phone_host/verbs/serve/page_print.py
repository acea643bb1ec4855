"""What the page's options of `print` mean."""

from pathlib import Path

from phone_host.output.data_folder import data_folder
from phone_host.printers.bed import parse_bed
from phone_host.printers.doors import configured_door
from phone_host.printers.journal import Journal
from phone_host.printers.preparing import Wanted
from phone_host.printers.printer_uri import read_uri
from phone_host.printers.slicing import SlicingWanted
from phone_host.serve.program import Choices, PrintWanted
from phone_host.settings import printer_keys


def asked_print(values: Choices, file: Path | None) -> PrintWanted:
    """Return how the page wants a scan printed. Nothing is opened.

    Args:
        values: `printer`, which may be missing, and `bed`.
        file: settings file with the keys of servers; None: there is none.

    Raises:
        SettingsError: they make no sense.
    """
    text = values.get("printer", "").strip()
    bed = parse_bed(words) if (words := values.get("bed", "").strip()) else None
    how, journal = Wanted(SlicingWanted(bed)), Journal(data_folder() / "printing")
    if not text:
        return PrintWanted("", None, None, how, journal)
    uri = read_uri(text)
    return PrintWanted(uri.text, uri, configured_door(uri, *printer_keys(file)), how, journal)
