"""The bed that a model has to fit on, as the options of the verbs that print name it."""

import argparse
from typing import Final

from phone_host.printers.bed import Bed, parse_bed

BED_HELP: Final = "what the printer holds: width, depth and height, mm; @centre or @X,Y behind them says where the coordinates begin, round:DIAMETER,HEIGHT a round one"


def bed_of(options: argparse.Namespace) -> Bed | None:
    """Read --bed; None: it is not given.

    Raises:
        SettingsError: it is none.
    """
    return None if options.bed is None else parse_bed(options.bed)
