"""The page of file formats describes every key of every report; reports here are made by the programs' own code."""

import re
from dataclasses import replace
from pathlib import Path
from typing import Final

import pytest

from common.camera.base import CameraHealth, CameraState
from common.diagnostic import Diagnostic, Severity
from common.frame import FrameFault
from common.protocol.message import BoardCounts, DropReason
from phone_host.accounts.delays import SinkAccount, replay_facts
from phone_host.accounts.link_account import Away, LinkAccount, LinkTally, SessionAccount
from phone_host.bench.report import as_json
from phone_host.diagnostics.run_snapshot import RecordingAccount, RunSnapshot
from phone_host.model import CutCounts, DepthAccount, DepthLimits, Drift, MatchReport, Search
from phone_host.report.quality_json import quality_json
from phone_host.report.run_json import build
from phone_host.report.stereo_json import pair_json, set_json
from phone_host.report.stereo_report import FailedPair, SetReport
from phone_host.sync.clock import ClockEstimate
from phone_host.sync.phase import Aligning, Alignment, Phase
from phone_host.sync.quarantine import Suspects
from tests.docs.commands import ROOT
from tests.support import bench_results, budget_accounts, quality_pages, run_snapshots
from tests.support.pictures import encoded
from tests.unit.report import test_stereo_report
from tests.unit.verbs import test_calibrate_verb

_TEXT: Final = (ROOT / "docs" / "files.md").read_text(encoding="utf-8")

_BY_NAME: Final = frozenset(
    {"delays_ms", "stages_ms", "delays", "stages", "not_measured", "sinks"}
    | {"dropped", "orphaned", "disbelieved", "spoiled_images", "faults", "full_pairs"}
    | {"dropped_on_board_frames", "disbelieved_frames", "orphaned_frames"}
)
"""Keys whose inner keys are names of stages, sinks or reasons."""


def keys_of(value: object, inside: str = "") -> set[str]:
    """All keys of a report, without the names that stand for keys."""
    if isinstance(value, list | tuple):
        return {key for inner in value for key in keys_of(inner)}
    if not isinstance(value, dict):
        return set()
    own = set() if inside in _BY_NAME else set(value)
    return own | {key for name, inner in value.items() for key in keys_of(inner, str(name))}


def described_words(*headings: str) -> set[str]:
    """The words in code type of some sections."""
    sections = [_TEXT.partition(f"\n## {heading}\n")[2].partition("\n## ")[0] for heading in headings]
    assert all(sections)
    return {word for section in sections for word in re.findall(r"`(\w+)`", section)}


def eventful_run() -> RunSnapshot:
    """A run in which everything happened that has keys of its own."""
    estimate = ClockEstimate(
        reference_ns=0, offset_ns=5_000, skew=2e-6, skew_uncertainty=1e-7, uncertainty_ns=30_000,
        round_trip_ns=400_000, low_ns=-200_000, high_ns=210_000, skew_low=-1e-4, skew_high=1e-4,
    )  # fmt: skip
    account = SessionAccount("s", BoardCounts(), BoardCounts(40, 35, ((DropReason.REPLACED, 5),)), received=31)
    link = LinkAccount([account], links=(LinkTally("tcp", frames=31),), clock_steps=1)
    link.suspects.append(Suspects(session="s", first=11, last=17, frames=7))
    usual = run_snapshots.run(31)
    return replace(
        usual,
        estimate=estimate,
        link=link,
        phase=Phase(time_skew_ns=5e6, period_ns=50_000_000, drift=1e-4, first_ns=0),
        alignment=Alignment(state=Aligning.ALIGNED, words="w", corrections=3, before_ns=9e6, after_ns=5e5),
        camera=CameraHealth(CameraState.RUNNING, jitter_ns=1_000, faults=((FrameFault.NO_END, 8),)),
        away=(Away(at_s=1.0, seconds=2.0, is_over=True),),
        sinks=(
            SinkAccount(
                name="files", written=1, dropped=0, failed=0, waiting=0, delay=usual.delays.spread("processing")
            ),
        ),
        own_future=4,
        recording=RecordingAccount(
            file="s.mcap", frames=9, dropped=1, lost=0, size_bytes=7, failure=Diagnostic("p", "r", Severity.FAIL)
        ),
        replay=replay_facts("s.mcap", "clock", []),
        budget=budget_accounts.ACCOUNT,
        depth=DepthAccount(
            cut=CutCounts(kept=5),
            limits=DepthLimits(near_m=0.0, far_m=9.0, disparity_error_px=0.25, from_rig=True),
            search=Search(disparities=64),
            median_report=MatchReport(vertical_px=0.4),
        ),
    )


def test_every_key_of_a_report_of_stereo_is_described() -> None:
    """That of one pair, and that of several of which one failed."""
    pair = replace(test_stereo_report.PAIR, trust=test_stereo_report.BAD)
    failed = FailedPair(name="p", left="l", right="r", failure=Diagnostic("bad", "mend"))
    keys = keys_of(pair_json(pair)) | keys_of(set_json(SetReport(pairs=(pair, failed), by_number=True, drift=Drift())))
    assert len(keys - {"total"}) >= 55
    assert keys <= described_words("What `--json` prints", "report.json of `stereo`")


def test_every_key_of_a_report_of_quality_is_described() -> None:
    """That of a pair with a plane, and of one that failed."""
    keys = keys_of(quality_json(quality_pages.report(failed=True)))
    assert len(keys) >= 40
    assert keys <= described_words("What `--json` prints", "report.json of `stereo`", "report.json of `quality`")


def test_every_key_of_a_report_of_run_is_described() -> None:
    """That of a run with absences, doubts, losses and an alignment; what `stereo` has, too, is described there."""
    keys = keys_of(build(eventful_run()))
    assert len(keys) >= 120
    assert keys <= described_words("What `--json` prints", "report.json of `stereo`", "report.json of `run`")


def test_every_key_of_a_report_of_calibrate_is_described(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """That of a rig, and that of images which gave none."""
    folder = test_calibrate_verb.folders(tmp_path, lambda image: encoded(".png", image))
    _, report = test_calibrate_verb.calibrated(folder)
    keys = keys_of(report)
    assert "written to" in capsys.readouterr().out
    assert len(keys) >= 30
    assert keys <= described_words("What `--json` prints", "report.json of `calibrate`")


def test_every_key_of_delay_bench_json_is_described() -> None:
    """Two interfaces and the predictions that follow from them."""
    results = [bench_results.result(), bench_results.result(link="ipc")]
    report = as_json(results, bench_results.UNDER, bench_results.analysed(*results))
    keys = keys_of(report)
    assert len(keys) >= 70
    assert keys <= described_words("What `--json` prints", "delay-bench.json")
