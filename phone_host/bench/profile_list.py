"""Prints the list of `delay-bench --emulate list`: the interfaces that a link can emulate."""

import argparse
import json
from dataclasses import asdict

from common.program.terminal import fitted
from phone_host.bench.emulate import PROFILES


def run(options: argparse.Namespace) -> int:
    """Print the profiles."""
    if options.json:
        print(json.dumps({"profiles": [asdict(profile) for profile in PROFILES]}))
        return 0
    print(fitted(f"{'name':17} {'over':6} {'kB/s':>7} {'delay, ms':>13}  {'loss':22} from"))
    for profile in PROFILES:
        least_ms, most_ms = profile.delay_ns / 1e6, (profile.delay_ns + profile.jitter_ns) / 1e6
        delay = f"{least_ms:g}" if least_ms == most_ms else f"{least_ms:g} to {most_ms:g}"
        stalls = f"1 of {1 / profile.stall_share:.0f} segments" if profile.stall_share else ""
        loss = f"1 byte of {1 / profile.byte_loss:.0f}" if profile.byte_loss else stalls
        rate = f"{profile.bytes_per_s / 1e3:g}"
        print(fitted(f"{profile.name:17} {profile.carrier:6} {rate:>7} {delay:>13}  {loss:22} {profile.source}"))
    return 0
