"""The program's state as the JSON that the page gets. Pure.

`live` ends with its samples, because those differ from viewer to viewer and all else is made once for all of them.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from typing import Final

from common.diagnostic import Diagnostic, Severity
from common.ledger import PairLedger
from common.words import counted
from phone_host.diagnostics.headline import Grade, headline
from phone_host.diagnostics.run_rules import concerns
from phone_host.diagnostics.run_snapshot import RecordingAccount, RunSnapshot, unused
from phone_host.model import DepthAccount, Unwritten
from phone_host.output.json_text import json_number, json_text
from phone_host.report.json_result import json_values, problem_values, result_values
from phone_host.report.match_words import cut_sentence
from phone_host.report.stereo_trust import Doubt
from phone_host.web.source import Answer, Choice, Measured, PageState, Step, StepName

MOST_SAMPLES: Final = 120
"""Samples in one message: 4 s of them at 30/s; a chart shows no more of a moment."""

_RECENT: Final = 60
"""Pairs over which rate and time skew are told while a run goes on."""


_SILENT_STEPS: Final = 3
"""Results that stay away for so many of their intervals are no longer a matter of jitter."""


@dataclass(frozen=True, slots=True)
class Sample:
    """The delays of one pair, for the charts.

    Attributes:
        number: of the result.
        done_ns: when it was done, host's monotonic clock.
        text: its row, JSON.
        begun: number of its run.
    """

    number: int
    done_ns: int
    text: str
    begun: int = 0


@dataclass(frozen=True, slots=True)
class StateText:
    """A state, but for the samples.

    Attributes:
        before: the text up to the samples; they stand last in `live`.
        after: the text behind them; empty if there is no `live`, and so no place for samples.
        begun: number of the run to which its samples belong.
    """

    before: str
    after: str
    begun: int = 0


def sample(number: int, ledger: PairLedger, begun: int = 0) -> Sample:
    """Return the row of a pair: done, s; then the delays and the time skew, ms.

    Args:
        number: of the result.
        ledger: its marks and delays.
        begun: number of its run.
    """
    delays_ns = (
        ledger.capture_ns,
        ledger.outbox_ns,
        ledger.propagation_ns,
        ledger.pairing_ns,
        ledger.queuing_ns,
        ledger.processing_ns,
        ledger.end_to_end_ns,
        ledger.time_skew_ns,
    )
    row = [round(ledger.done_ns / 1e9, 4), *(round(value / 1e6, 3) for value in delays_ns)]
    return Sample(number, ledger.done_ns, json_text(row), begun)


def state_text(state: PageState, samples: Sequence[Sample], now_ns: int) -> StateText:
    """Write a state.

    Args:
        state: the state.
        samples: the newest ones, oldest first, of any run; those of the state's run tell the rate.
        now_ns: the time, host's monotonic clock.
    """
    values: dict[str, object] = {
        "kind": "state",
        "activity": state.activity.value,
        "steps": [{"name": step.name.value, "done": step.done, "words": step.words} for step in state.steps],
        "command": state.command,
        "scan_command": state.scan_command,
        "settings": dict(state.settings),
        "boards": _choices(state.boards),
        "cameras": _choices(state.cameras),
        "stranger": state.stranger,
        "checks": [
            {"what": each.code, "grade": each.severity.value, "words": each.message, "remedy": each.remedy}
            for each in state.checks
        ],
        "matchers": list(state.matchers),
        "guide": None if state.guide is None else dict(state.guide),
        "scan": None if state.scan is None else asdict(state.scan),
        "printing": None if state.printing is None else asdict(state.printing) | {"stage": state.printing.stage.value},
        "trouble": problem_values(state.trouble),
        "changed": state.changed,
        "begun": state.begun,
    }
    if state.run is None:
        return StateText(json_text(values | {"live": None})[:-1], "", state.begun)
    own = [item for item in samples if item.begun == state.begun]
    live = json_text(_live(state.run, own, state.steps, now_ns))
    return StateText(f'{json_text(values)[:-1]}, "live": {live[:-1]}, "samples": [', "]}", state.begun)


def whole_text(state: StateText, samples: Sequence[Sample], report: str = "null") -> str:
    """Write a state with samples and report.

    Args:
        state: the state.
        samples: those that the viewer does not have yet; at most the newest `MOST_SAMPLES` are told.
        report: report.json's object, or null.
    """
    rows = ", ".join(item.text for item in samples[-MOST_SAMPLES:]) if state.after else ""
    return f'{state.before}{rows}{state.after}, "report": {report}}}'


def answer_values(answer: Answer) -> dict[str, object]:
    """Return what became of a command."""
    return problem_values(answer.trouble) or {"words": answer.words}


def measured_values(measured: Measured) -> dict[str, object]:
    """Return places and distances, m."""
    return {
        "places_m": [None if place is None else list(place) for place in measured.places_m],
        "place_sigmas_m": list(measured.place_sigmas_m),
        "distances_m": list(measured.distances_m),
        "length_m": measured.length_m,
        "length_sigma_m": measured.length_sigma_m,
        "words": measured.words,
    }


def _choices(choices: Sequence[Choice] | None) -> list[dict[str, str]] | None:
    return None if choices is None else [{"uri": one.uri, "name": one.name, "note": one.note} for one in choices]


def _live(run: RunSnapshot, samples: Sequence[Sample], steps: Sequence[Step], now_ns: int) -> dict[str, object]:
    """Return what changes all the time, but for the samples."""
    skew_ns = run.delays.spread("time_skew", _RECENT).p50_ns
    return {
        "trust": _trust(run, steps),
        "ended": run.ended,
        "pairs": run.processed,
        "pairs_per_s": json_number(_rate(run, samples, now_ns), 4),
        "time_skew_ms": None if run.timeless else json_number(skew_ns / 1e6, 4),
        "density": json_number(run.images.now.density, 4),
        "cropped": run.depth.cut is not None and run.depth.cut.outside > 0,
        "cut": _cut(run.depth),
        "link": _link(run),
        "clock": _clock(run),
        "drops": {item.words: item.count for item in unused(run)},
        "sinks": [
            {"name": sink.name, "written": sink.written, "dropped": sink.dropped, "failed": sink.failed}
            for sink in run.sinks
        ],
        "carrier": run.carrier,
        "recording": None if run.recording is None else _recording(run.recording),
        "unsaved": _unsaved(run.unwritten),
    }


def _cut(depth: DepthAccount) -> str:
    """Say of how many pixels the limits leave nothing; disparities like the noise of zero are those of what is too far."""
    cut = depth.cut
    if cut is None:
        return ""
    return cut_sentence(replace(cut, too_far=cut.too_far + cut.at_zero, at_zero=0), depth.limits)


def _unsaved(unwritten: Unwritten) -> dict[str, object] | None:
    if not unwritten.cause:
        return None
    lost = f"{counted(unwritten.pairs, 'pair')} could not be saved" if unwritten.pairs else "delays could not be saved"
    return problem_values(
        Diagnostic(f"{lost} ({unwritten.cause})", "make room, or end the run and give another folder", Severity.FAIL)
    )


def _recording(account: RecordingAccount) -> dict[str, object]:
    return json_values(account) | {"words": account.words}


def _trust(run: RunSnapshot, steps: Sequence[Step]) -> dict[str, object]:
    if not run.processed and run.ended == "running" and run.failure is None:
        return {"level": "unknown", "headline": _no_pair(run), "concerns": []}
    said = headline(run)
    if said.grade is Grade.GOOD and not run.images.wants_depth:
        words = f"No depth in this run, only pairs and delays. {_next(steps)}"
        return {"level": "unknown", "headline": words, "concerns": []}
    return {
        "level": said.grade.value,
        "headline": said.sentence,
        "concerns": [result_values(Doubt, item) | {"problem": item.message} for item in concerns(run)],
    }


def _no_pair(run: RunSnapshot) -> str:
    """Say that there is no pair yet, and why if that is known."""
    if run.refused is not None:
        return f"No pair yet: {run.refused.message}. Then: {run.refused.remedy}."
    if _link(run)["up"]:
        return "No pair has been processed yet."
    return "No pair yet: no board answers. Start board-agent there, and check its power, its network and its address."


def _next(steps: Sequence[Step]) -> str:
    """Return what leads to depth: the calibration, else the first step that is not done."""
    if not steps:
        return "It has no calibration."
    missing = sorted((step for step in steps if not step.done), key=lambda step: step.name is not StepName.CALIBRATION)
    return f"Next: {missing[0].words if missing else 'start a run'}."


def _rate(run: RunSnapshot, samples: Sequence[Sample], now_ns: int) -> float:
    """Return results per s: of late while the run goes on, less once they stay away; over all of it afterwards."""
    recent = samples[-_RECENT:]
    if run.ended != "running" or len(recent) < 2 or recent[-1].done_ns <= recent[0].done_ns:
        return run.pairs_per_second
    rate = (recent[-1].number - recent[0].number) / ((recent[-1].done_ns - recent[0].done_ns) / 1e9)
    silent_s = (now_ns - recent[-1].done_ns) / 1e9
    return rate if silent_s < _SILENT_STEPS / rate else 1 / silent_s


def _link(run: RunSnapshot) -> dict[str, object]:
    names = [run.carrier, *(tally.name for tally in run.link.links if tally.is_up), *(t.name for t in run.link.links)]
    name = next((each for each in names if each), "")
    return {"name": name, "up": any(tally.is_up for tally in run.link.links)}


def _clock(run: RunSnapshot) -> dict[str, object]:
    if run.estimate is None:
        return {"known": False, "offset_ms": None, "uncertainty_us": None}
    return {
        "known": True,
        "offset_ms": run.estimate.offset_ns / 1e6,
        "uncertainty_us": run.estimate.uncertainty_ns / 1e3,
    }
