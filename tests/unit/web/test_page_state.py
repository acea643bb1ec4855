"""The state as JSON: whole, with samples and report only where they belong."""

import json
from dataclasses import replace

from common.diagnostic import Diagnostic, Severity
from phone_host.accounts.link_account import LinkAccount, LinkTally
from phone_host.model import CutCounts, DepthAccount, DepthLimits, PairCounts, Unwritten
from phone_host.sync.clock import ClockEstimate
from phone_host.web.openapi import description
from phone_host.web.source import Activity, Answer, Measured, PageState, Step, StepName
from phone_host.web.state_json import answer_values, measured_values, sample, state_text, whole_text
from tests.support.page_source import PageSource
from tests.support.run_snapshots import MS, run
from tests.support.samples import LEDGER

SAMPLES = [sample(number, replace(LEDGER, done_ns=number * 100 * MS, time_skew_ns=-MS)) for number in range(200)]

NOW_NS = 19_950 * MS
"""Shortly after the last sample."""


def told(state: PageState, **texts: object) -> dict[str, object]:
    """Return the state as a browser reads it."""
    read: dict[str, object] = json.loads(whole_text(state_text(state, SAMPLES, NOW_NS), SAMPLES, **texts))  # type: ignore[arg-type]
    return read


def test_an_idle_program_has_nothing_live() -> None:
    """Without a run there are neither samples nor a report; every field that is described is there."""
    values = told(PageSource().state())
    assert values["live"] is None
    assert values["report"] is None
    assert values["trouble"] == {"problem": "no board is chosen", "remedy": "choose one first"}
    schemas = description({})["components"]["schemas"]  # type: ignore[index]
    assert set(schemas["State"]["required"]) <= set(values)
    assert told(PageState(activity=Activity.ENDING, guide={"coverage": 0.5}))["guide"] == {"coverage": 0.5}


def test_a_run_has_its_newest_samples() -> None:
    """At most 120 are told: done, s, then delays and time skew, ms. The rate is that of the newest: one each 100 ms."""
    state = PageState(activity=Activity.RUNNING, run=replace(run(5), ended="running"))
    values = told(state, report='{"pairs": 5}')
    live = values["live"]
    assert isinstance(live, dict)
    assert len(live["samples"]) == 120
    assert live["samples"][-1] == [19.9, 0, 0, 0, 0, 0, 19900, 19900, -1]
    assert live["pairs_per_s"] == 10.0
    assert live["time_skew_ms"] == 0
    assert values["report"] == {"pairs": 5}
    assert live["trust"]["level"] == "unknown"
    assert live["clock"] == {"known": False, "offset_ms": None, "uncertainty_us": None}
    assert live["link"] == {"name": "", "up": False}


def test_the_rate_falls_when_pairs_stay_away() -> None:
    """Ten a second, up to three intervals of silence; then no more than one in the time since the last."""
    state = PageState(activity=Activity.RUNNING, run=replace(run(5), ended="running"))
    for silent_s, rate in ((0.25, 10.0), (1.0, 1.0), (20.0, 0.05)):
        values = json.loads(whole_text(state_text(state, SAMPLES, int((19.9 + silent_s) * 1e9)), SAMPLES))
        assert values["live"]["pairs_per_s"] == rate


def test_what_limits_left_out_is_said() -> None:
    """Of all pixels: those too far, with those that are like the noise of zero, and those outside the crop; without limits nothing."""
    limits = DepthLimits(near_m=0.0, far_m=2.5, disparity_error_px=0.2, from_rig=False)
    cut = CutCounts(kept=30, unmatched=10, at_zero=4, too_far=6, outside=50)
    for depth, cropped, words in (
        (DepthAccount(cut=cut, limits=limits), True, "10 % farther than 2.5 m, 50 % outside the crop"),
        (DepthAccount(cut=CutCounts(kept=9, unmatched=1), limits=limits), False, ""),
        (DepthAccount(), False, ""),
    ):
        live = told(PageState(activity=Activity.RUNNING, run=replace(run(5), ended="running", depth=depth)))["live"]
        assert isinstance(live, dict)
        assert (live["cropped"], live["cut"]) == (cropped, words)


def test_a_run_without_pairs_is_not_judged_yet() -> None:
    """Nothing can be said before the first pair; a run that ended without one is bad."""
    state = PageState(activity=Activity.RUNNING, run=replace(run(0), ended="running"))
    live = told(state)["live"]
    assert isinstance(live, dict)
    assert live["trust"]["level"] == "unknown"
    assert live["density"] is None
    ended = told(PageState(activity=Activity.IDLE, run=run(0)))["live"]
    assert isinstance(ended, dict)
    assert ended["trust"]["level"] == "bad"
    assert ended["pairs_per_s"] is None


def test_why_there_is_no_pair_and_what_was_not_saved_are_told() -> None:
    """A board that is silent or refuses stands in the headline, a full disk beside it."""
    waiting = replace(run(0), ended="running")
    up = replace(waiting, link=LinkAccount([], links=(LinkTally("tcp", is_up=True),)))
    refused = replace(waiting, refused=Diagnostic("another host has the board", "stop it", Severity.FAIL))
    for state, words in (
        (waiting, "no board answers"),
        (up, "No pair has been"),
        (refused, "another host has the board"),
    ):
        live = told(PageState(activity=Activity.RUNNING, run=state))["live"]
        assert isinstance(live, dict)
        assert words in live["trust"]["headline"]
        assert live["unsaved"] is None
    for unwritten, words in (
        (Unwritten(pairs=2, cause="full"), "2 pairs could not"),
        (Unwritten(lines=9, cause="full"), "delays could"),
    ):
        live = told(PageState(activity=Activity.RUNNING, run=replace(waiting, unwritten=unwritten)))["live"]
        assert isinstance(live, dict)
        assert live["unsaved"]["problem"].startswith(words)


def test_rate_of_an_ended_run_is_that_of_all_of_it() -> None:
    """Five pairs 50 ms apart are 20 a second, whatever the newest samples say."""
    live = told(PageState(activity=Activity.IDLE, run=run(5)))["live"]
    assert isinstance(live, dict)
    assert live["pairs_per_s"] == 20.0
    assert live["trust"]["concerns"] == []


def test_samples_of_another_run_do_not_count() -> None:
    """After a pause of 100 s the new run's pairs come 100 ms apart: that is its rate from the second pair on."""
    later = [sample(200 + k, replace(LEDGER, done_ns=(1200 + k) * 100 * MS), begun=1) for k in range(3)]
    state = PageState(activity=Activity.RUNNING, run=replace(run(3), ended="running"), begun=1)
    for samples, rate in ((SAMPLES + later, 10.0), (SAMPLES, 20.0)):
        text = state_text(state, samples, NOW_NS)
        assert text.begun == 1
        assert json.loads(whole_text(text, ()))["live"]["pairs_per_s"] == rate


def test_without_depth_there_is_no_answer_but_a_next_step() -> None:
    """A run of pairs and delays only is no good depth: unknown, with what leads to depth; a concern is still said."""
    flat = run(5)
    step = Step(name=StepName.CALIBRATION, done=False, words="calibrate")
    others = tuple(Step(name=name, done=name is not StepName.CHECK, words="x") for name in StepName)
    done = tuple(replace(each, done=True) for each in others)
    cases = (
        ((*others, step), "Next: calibrate."),
        (others, "Next: x."),
        (done, "Next: start a run."),
        ((), "no calibration."),
    )
    for steps, words in cases:
        live = told(PageState(activity=Activity.IDLE, run=flat, steps=steps))["live"]
        assert isinstance(live, dict)
        assert live["trust"]["level"] == "unknown"
        assert live["trust"]["headline"].endswith(words)
    deep = replace(flat, images=replace(flat.images, wants_depth=True))
    live = told(PageState(activity=Activity.IDLE, run=deep))["live"]
    assert isinstance(live, dict)
    assert live["trust"]["level"] != "unknown"


def test_links_clock_and_drops() -> None:
    """The carrier is named first, else a link that is up; drops stand by place and reason; stills have no time skew."""
    links = (LinkTally("serial"), LinkTally("tcp", is_up=True))
    clock = ClockEstimate(
        reference_ns=0, offset_ns=5 * MS, skew=0, skew_uncertainty=0, uncertainty_ns=2000, round_trip_ns=1, low_ns=0,
        high_ns=0, skew_low=0, skew_high=0,
    )  # fmt: skip
    counts = PairCounts(received=9, paired=5, dropped=2, taken=3)
    snapshot = replace(run(3), link=LinkAccount([], links=links), estimate=clock, counts=counts, timeless=True)
    live = told(PageState(activity=Activity.IDLE, run=snapshot))["live"]
    assert isinstance(live, dict)
    assert live["link"] == {"name": "tcp", "up": True}
    assert live["clock"] == {"known": True, "offset_ms": 5.0, "uncertainty_us": 2.0}
    assert 2 in live["drops"].values()
    assert live["time_skew_ms"] is None
    carried = told(PageState(activity=Activity.IDLE, run=replace(snapshot, carrier="serial")))["live"]
    assert isinstance(carried, dict)
    assert carried["link"]["name"] == "serial"


def test_answers() -> None:
    """What happened, or why it did not; places with None where there is no depth."""
    assert answer_values(Answer(words="Done.")) == {"words": "Done."}
    assert answer_values(Answer(trouble=Diagnostic("p", "r", Severity.FAIL))) == {"problem": "p", "remedy": "r"}
    measured = Measured(
        places_m=((1, 2, 3), None), distances_m=(3.7, None), place_sigmas_m=(0.1, None), words="no depth"
    )
    assert measured_values(measured)["places_m"] == [[1, 2, 3], None]
