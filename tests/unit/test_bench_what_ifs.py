"""What the delay benchmark says beyond its runs: of frames of one size, and of interfaces that were run already."""

import math
from dataclasses import replace

from phone_host.bench.cases import Case, Interface, Size
from phone_host.bench.emulate import PROFILES
from phone_host.bench.tables import fit_lines
from tests.unit.test_bench_report import analysed, result


def test_frames_of_one_size_tell_no_rate() -> None:
    """Where all frames had 50 kB latency and rate cannot be told apart, and the terminal says that in place of figures."""
    analysis = analysed(result())
    assert math.isnan(analysis.fits[0].fit.ns_per_byte)
    assert fit_lines(analysis) == ["tcp: frames of one size only, so latency and rate cannot be told apart"]


def test_an_interface_that_was_run_is_not_guessed_from_its_figures() -> None:
    """Each profile that nobody ran is predicted from its figures alone, in the place of the link that was; the one that was run is not."""
    ran, *others = PROFILES
    case = Case(interface=Interface(ran.carrier, ran), size=Size(640, 480), quality_percent=80, rate_hz=30)
    analysis = analysed(replace(result(), case=case))
    guessed = {one.interface for one in analysis.what_ifs if "from its figures alone" in one.setting}
    assert guessed == {str(Interface(profile.carrier, profile)) for profile in others}
