"""What the delay benchmark leaves out, and what its report, tables, page and figure say."""

import dataclasses
import html
import json
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.ledger import BoardMarks
from phone_host.accounts.delays import DELAYS, STAGES
from phone_host.bench.analysis import Analysis, WhatIf, analyse
from phone_host.bench.changes import parse_changes
from phone_host.bench.page import page
from phone_host.bench.prediction import Figures, Unknown
from phone_host.bench.report import as_json, losses
from phone_host.bench.runs import WARM_UP_S, after_warm_up
from phone_host.bench.tables import (
    checked_rows,
    fit_lines,
    fit_rows,
    prediction_lines,
    rate_text,
    regime_lines,
    result_sentence,
    rows,
    summary_line,
    what_if_rows,
)
from phone_host.model import PairCounts
from tests.support.bench_results import UNDER, analysed, ledger, result, slower

UNITS = ("_ms", "_us", "_ns", "_s", "_hz", "_px", "_bytes", "_frames", "_pairs", "_runs", "_percent", "stalls")


def keys_of_numbers(value: Any, key: str = "") -> list[str]:
    if isinstance(value, dict):
        # A dictionary of counts by reason takes its unit from its own key.
        return [
            found
            for name, inner in value.items()
            for found in keys_of_numbers(inner, key if key.endswith(UNITS) else name)
        ]
    if isinstance(value, list):
        return [found for inner in value for found in keys_of_numbers(inner, key)]
    return [key] if isinstance(value, int | float) else []


@given(st.integers(0, 200))
def test_the_first_second_is_left_out(pairs: int) -> None:
    """Pairs done within a second of the first one are left out and all later ones kept; pairs over their time is the rate at which they were done."""
    done = [ledger(number) for number in range(pairs)]
    kept, measured_s = after_warm_up(done)
    begin_ns = 30_000_000 + round(WARM_UP_S * 1e9)
    assert list(kept) == [pair for pair in done if pair.done_ns > begin_ns]
    assert measured_s == pytest.approx(len(kept) * 0.033)


def test_every_number_of_the_report_has_its_unit_in_its_key() -> None:
    """A reader needs only the key to know what a number is."""
    report = as_json([result()], UNDER, analysed(result()))
    assert json.loads(json.dumps(report, allow_nan=False)) == report
    assert [key for key in keys_of_numbers(report) if not key.endswith(UNITS)] == []


def test_report_holds_each_delay_and_stage() -> None:
    """The known delays of the pairs are reported, stage by stage, in ms."""
    run: Any = as_json([result()], UNDER, analysed(result()))["runs"]
    known = {
        "capture": 1,
        "outbox": 2,
        "propagation": 3,
        "pairing": 4,
        "queuing": 5,
        "processing": 15,
        "end_to_end": 30,
    }
    known |= {"starvation": 1}
    assert {name: run[0]["delays"][name]["p50_ms"] for name in DELAYS} == known
    assert {name: run[0]["stages"][name]["max_ms"] for name in STAGES} == {
        "decode": 1,
        "rectify": 0,
        "match": 14,
        "reproject": 0,
        "write": 0,
        "interpolate": 0,
    }
    assert run[0]["clock_uncertainty"]["p99_us"] == 40


def test_counts_of_the_report_are_conserved() -> None:
    """Grabbed = sent + dropped; sent = received + lost + under way; received = paired + orphaned; paired = processed + dropped."""
    runs: Any = as_json([result()], UNDER, analysed(result()))["runs"]
    whole = runs[0]["whole_run"]
    assert whole["grabbed_frames"] == whole["sent_frames"] + sum(whole["dropped_on_board_frames"].values())
    assert whole["sent_frames"] == whole["received_frames"] + whole["lost_on_link_frames"] + 1
    assert whole["under_way_at_end_frames"] == 1
    assert whole["received_frames"] == whole["paired_pairs"] + sum(whole["orphaned_frames"].values())
    assert whole["paired_pairs"] == whole["processed_pairs"] + whole["dropped_in_fifo_pairs"]


def test_each_run_says_which_regime_held_and_what_would_help() -> None:
    """Work of 15 ms after a wait of 1 ms is a backlog; after a wait of 85 ms, at a tenth of the cameras' rate, it is a slow link. Object, terminal and page say so."""
    busy, waiting = result(pairs=100), result(link="serial")
    far = [
        dataclasses.replace(
            ledger(number, 330_000_000),
            board=BoardMarks(  # the frame is on its way for the 100 ms before it arrives
                exposed_ns=number * 330_000_000 - 97_000_000,
                grabbed_ns=number * 330_000_000 - 96_000_000,
                sent_ns=number * 330_000_000 - 94_000_000,
            ),
            previous_done_ns=number * 330_000_000 - 75_000_000,
        )
        for number in range(100)
    ]
    kept, measured_s = after_warm_up(far)
    waiting = dataclasses.replace(
        waiting, ledgers=kept, measured_s=measured_s, counts=PairCounts(received=101, paired=101, taken=100)
    )
    runs: Any = as_json([busy, waiting], UNDER, analysed(busy, waiting))["runs"]
    assert [run["regime"]["regime"] for run in runs] == ["backlog", "starved by the link"]
    assert "94 %" in runs[0]["regime"]["sentence"]
    assert any("smaller frames" in remedy for remedy in runs[1]["regime"]["remedies"])
    text = html.unescape(page([busy, waiting], UNDER, analysed(busy, waiting)))
    for one, run in zip((busy, waiting), runs, strict=True):
        assert list(regime_lines(one, UNDER.fifo)) == [run["regime"]["sentence"], *run["regime"]["remedies"]]
        assert all(line in text for line in regime_lines(one, UNDER.fifo))


def test_losses_name_what_became_of_each_frame() -> None:
    """Only reasons that happened are named."""
    assert losses(result()) == {
        "no_host_on_board": 3,
        "lost_on_link": 2,
        "no_partner_board_frame": 1,
        "dropped_in_fifo": 1,
    }


def test_the_line_of_a_run_never_sets_an_uncertainty_above_its_bound() -> None:
    """Uncertainty and hard bound are from one moment, 45 and 70 us; the uncertainty that the pairs had (40 us) is given separately, with the number of pairs; each loss is a sentence."""
    line = summary_line(result())
    assert line.startswith(
        f"{len(result().ledgers)} pairs, 30.3/s, clock of the pairs +-40 us (p95), at the end +-45 us (+-70 us "
    )
    assert line.endswith(
        "; whole run: 3 frames came before the host connected, 2 frames lost on the link, 1 frame not used (no partner), 1 pair dropped from the full FIFO"
    )
    assert fit_rows(analysed(result()))[0][7:9] == ("\u00b145.0\u202f\u00b5s", "\u00b170.0\u202f\u00b5s")
    nothing = dataclasses.replace(result(pairs=0), uncertainty_ns=math.nan, bound_ns=math.nan)
    assert summary_line(nothing).startswith("no pairs, clock not known at the end")


def test_what_a_line_cannot_tell_is_said_in_words() -> None:
    """A latency of 0 is too small to tell, and a level line has no rate: table, terminal and page say so."""
    analysis = analysed(result())

    def fitted(latency_ns: float, ns_per_byte: float) -> Analysis:
        fit = dataclasses.replace(analysis.fits[0].fit, latency_ns=latency_ns, ns_per_byte=ns_per_byte)
        return dataclasses.replace(analysis, fits=(dataclasses.replace(analysis.fits[0], fit=fit),))

    for known, words in (
        (fitted(0.0, 10.0), "too small to tell + bytes / 100 MB/s"),
        (fitted(120e3, 10.0), "120\u202f\u00b5s + bytes / 100 MB/s"),
        (fitted(120e3, 0.0), "120\u202f\u00b5s, larger frames are no slower"),
    ):
        assert words in page([result()], UNDER, known)
        assert words.split(" + ")[0].split(",")[0] in fit_lines(known)[0]
        assert fit_rows(known)[0][1] == words.split(" + ")[0].split(",")[0]
    assert "no slower" in fit_lines(fitted(120e3, 0.0))[0]


def test_a_run_without_pairs_is_reported_without_numbers() -> None:
    """What was not measured is null in JSON and a dash in the table, never a zero."""
    empty = result(pairs=0)
    runs: Any = as_json([empty], UNDER, analysed(empty))["runs"]
    assert runs[0]["delays"]["processing"]["p50_ms"] is None
    assert runs[0]["pair_rate_hz"] is None
    assert {cell for row in rows([empty]) for cell in row[2:]} == {"-"}
    assert "No pair was processed" in page([empty], UNDER, analysed(empty))


def test_one_sentence_says_which_link_is_fastest_and_what_takes_longest() -> None:
    """The fastest link is named with its median and its largest part; links within 5 % are equally fast; nothing measured makes no sentence."""
    assert result_sentence([slower("ipc", 2.0), result()]).replace("\u202f", " ") == (
        "tcp is the fastest link: 30.0 ms from exposure to depth at the median, with 640x480 JPEG 80 at 30 frames/s; the largest part is matching."
    )
    assert result_sentence([result(), slower("ipc", 1.04)]).startswith("tcp and ipc are equally fast: 30.0")
    assert result_sentence([result()]).startswith("tcp takes 30.0")
    assert "the largest part is capturing on the board" in result_sentence([slower("ipc", 3.0)])
    assert not result_sentence([result(pairs=0)])


def test_a_profile_that_loses_bytes_is_predicted_without_and_says_so() -> None:
    """The model knows rate, delay and jitter: a profile with losses is marked, asked for or not; one without is not."""
    settings = analyse([result()], UNDER.fifo, parse_changes(["link=wifi", "link=ethernet"])).what_ifs
    said = {one.setting if one.asked_for else one.interface: one.setting for one in settings}
    for name in ("link=wifi, without its losses", "usb-serial-lossy (serial)", "wifi (tcp)"):
        assert said[name].endswith(", without its losses")
    for name in ("link=ethernet", "usb-serial (serial)"):
        assert "losses" not in said[name]


def test_the_table_has_a_line_for_each_stage_and_link() -> None:
    """The table has every delay, and every stage that did something, once for each link."""
    table = rows([result(), result(link="ipc")])
    assert [row[0].strip() for row in table[::2]] == [
        "capture", "outbox", "propagation", "pairing", "queuing", "processing", "decode", "match", "end-to-end", "starvation", "time-skew",
    ]  # fmt: skip
    assert [row[1] for row in table[:2]] == ["tcp", "ipc"]
    assert all(len(row) == 6 for row in table)


@pytest.mark.parametrize(
    ("bytes_per_s", "text"),
    [(1.044e9, "1.04 GB/s"), (999.6e6, "1 GB/s"), (4.45e6, "4.45 MB/s"), (669e3, "669 kB/s"), (20.0, "0.02 kB/s")],
)
def test_a_rate_has_the_unit_that_keeps_it_short(bytes_per_s: float, text: str) -> None:
    """Rates are given with three digits in kB/s, MB/s or GB/s."""
    assert rate_text(bytes_per_s) == text


def test_predictions_stand_in_terminal_and_tables_with_reasons_where_there_are_none() -> None:
    """Each run is shown beside its prediction and what was asked for; where no prediction could be made, the reason stands in its place."""
    said = Figures(
        pairs_per_s=12.5,
        lost_share=0.25,
        propagation_p50_ns=3e6,
        queuing_p95_ns=4e6,
        starvation_p50_ns=5e6,
        end_to_end_p50_ns=21e6,
        end_to_end_p95_ns=30e6,
    )
    why = Unknown("nothing else was measured")
    checked = analysed(result()).checked[0]
    assert checked.measured.end_to_end_p50_ns == 30e6
    analysis = dataclasses.replace(
        analysed(result()),
        checked=(
            dataclasses.replace(checked, predicted=said, queues=said),
            dataclasses.replace(checked, predicted=why, queues=why),
        ),
        what_ifs=(
            WhatIf("tcp", "fps=60", said, asked_for=True),
            WhatIf("tcp", "fps=90", why, asked_for=True),
            WhatIf("wifi (tcp)", "the same", said),
        ),
    )
    lines = prediction_lines(analysis)
    runs = [line for line in lines if line.startswith("tcp 640x480")]
    assert [line.split("/s; ")[1] for line in runs] == ["21.0\u202fms, 12.5/s", f"no prediction: {why.reason}"]
    asked = lines[lines.index("predicted, not run:") + 1 :]
    assert [line.split(":")[0] for line in asked] == ["tcp fps=60", "tcp fps=90"]
    assert "12.5" in asked[0]
    assert "25 %" in asked[0]
    assert why.reason in asked[1]
    assert [row[2:3] for row in checked_rows(analysis)][1] == (f"no prediction: {why.reason}",)
    assert checked_rows(analysis)[0][2].endswith("| 12.5")
    assert [row[2] for row in what_if_rows(analysis)] == ["12.5", f"no prediction: {why.reason}", "12.5"]


def test_one_run_alone_is_compared_with_nothing() -> None:
    """A single run has no others to predict it from, and nothing was asked for: no line at all."""
    assert prediction_lines(analysed(result())) == []
