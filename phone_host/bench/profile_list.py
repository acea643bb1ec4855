"""Prints the list of `delay-bench --emulate list`: the interfaces that a link can emulate."""

import argparse
import json
from dataclasses import asdict
from typing import Final

from common.program.terminal import columns, fitted
from phone_host.bench.emulate import PROFILES

_TABLE: Final = 130
"""Columns of the table with the longest sources; a narrower terminal gets sentences."""


def run(options: argparse.Namespace) -> int:
    """Print the profiles."""
    if options.json:
        print(json.dumps({"profiles": [asdict(profile) for profile in PROFILES]}))
        return 0
    is_narrow = 0 < columns() < _TABLE
    if not is_narrow:
        print(f"{'name':17} {'over':6} {'kB/s':>7} {'delay, ms':>13}  {'loss':22} from")
    for profile in PROFILES:
        least_ms, most_ms = profile.delay_ns / 1e6, (profile.delay_ns + profile.jitter_ns) / 1e6
        delay = f"{least_ms:g}" if least_ms == most_ms else f"{least_ms:g} to {most_ms:g}"
        stalls = f"1 of {1 / profile.stall_share:.0f} segments" if profile.stall_share else ""
        loss = f"1 byte of {1 / profile.byte_loss:.0f}" if profile.byte_loss else stalls
        rate = f"{profile.bytes_per_s / 1e3:g}"
        if is_narrow:
            lost = f", loses {loss}" if loss else ""
            print(fitted(f"{profile.name}: {profile.carrier}, {rate} kB/s, {delay} ms{lost}"))
            print(fitted(f"  {profile.source}"))
        else:
            print(f"{profile.name:17} {profile.carrier:6} {rate:>7} {delay:>13}  {loss:22} {profile.source}")
    return 0
