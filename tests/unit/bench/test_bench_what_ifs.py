"""What the delay benchmark says beyond its runs: about frames of one size, and about interfaces that have been run."""

import math
from dataclasses import replace

from phone_host.bench.cases import Case, Interface, Size
from phone_host.bench.emulate import PROFILES
from phone_host.bench.tables import fit_lines
from tests.support.bench_results import analysed, result


def test_frames_of_one_size_tell_no_rate() -> None:
    """If all frames have 50 kB, latency and rate cannot be told apart, and the terminal says so instead of giving figures."""
    analysis = analysed(result())
    assert math.isnan(analysis.fits[0].fit.ns_per_byte)
    assert fit_lines(analysis) == ["tcp: frames of one size only, so latency and rate cannot be told apart"]


def test_an_interface_that_was_run_is_not_guessed_from_its_figures() -> None:
    """Each profile that was not run is predicted from its figures alone, in place of the real link; one that was run is not."""
    ran, *others = PROFILES
    case = Case(interface=Interface(ran.carrier, ran), size=Size(640, 480), quality_percent=80, rate_hz=30)
    analysis = analysed(replace(result(), case=case))
    guessed = {one.interface for one in analysis.what_ifs if "from its figures alone" in one.setting}
    assert guessed == {str(Interface(profile.carrier, profile)) for profile in others}
