"""The bed that a model has to fit on, as the options of the verbs that print name it."""

import argparse

from common.errors import SettingsError
from phone_host.verbs.units import length_mm


def bed_of(options: argparse.Namespace) -> tuple[float, float, float]:
    """Read --bed, mm.

    Raises:
        SettingsError: it is none.
    """
    words = options.bed.split(",")
    if len(words) != 3:
        raise SettingsError(f"--bed is {options.bed!r}", "give three lengths, for example 220,220,250")
    x, y, z = (length_mm(word, "--bed", "220,220,250") for word in words)
    return x, y, z
