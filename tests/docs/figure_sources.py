"""Where the figures of docs/figures.md come from: a command line for each, and how its JSON becomes rows.

All of them together take about an hour on two cores. Where a reference measurement exists, it
comes from the same run; otherwise its origin is stated.
"""

import math
import statistics
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any, Final

Data = Mapping[str, Any]


class Topic(Enum):
    """The page's sections, in order, by their headings."""

    DEPTH = "Depth"
    SCAN = "Scan"
    CALIBRATION = "Calibration"
    LINKS = "Links"
    CLOCK = "Clock"
    PAIRING = "Pairing"
    AGE = "Age and queues"
    RECORDINGS = "Recordings"
    PAGE = "Page"
    BOARD = "Board"


@dataclass(frozen=True, slots=True)
class Figure:
    """One row.

    Attributes:
        what: the quantity measured.
        figure: with its unit.
        anchor: the reference value; empty: none.
        limit: the value to reach; empty: none.
        reached: whether it was reached.
    """

    what: str
    figure: str
    anchor: str = ""
    limit: str = ""
    reached: bool = True


@dataclass(frozen=True, slots=True)
class Source:
    """A command whose JSON gives figures.

    Attributes:
        name: of its file in out/figures.
        topic: section of the page.
        title: what it measures, in one sentence.
        command: as a reader types it in the project's folder, with the environment activated.
        rows: turns its JSON into rows.
        about_s: how long it takes.
    """

    name: str
    topic: Topic
    title: str
    command: str
    rows: Callable[[Data], Iterator[Figure]]
    about_s: int


def _number(value: float | None) -> str:
    """Three digits, or all digits before the point."""
    if value is None or math.isnan(value):
        return "-"
    return f"{value:.{0 if abs(value) >= 100 else 1 if abs(value) >= 10 else 2}f}"


def _verdicts(data: Data) -> Iterator[Figure]:
    for verdict in data["verdicts"]:
        yield Figure(verdict["what"], verdict["found"], "", verdict["limit"], verdict["reached"])


def _page(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for row in data["rows"]:
        got = f"; {row['viewer_hz']:.1f} pairs/s of {row['kilobytes']:.0f} kB each" if row["viewer_hz"] else ""
        yield Figure(
            f"{row['phase']}: processing delay p50 / p99", f"{row['p50_ms']:.1f} / {row['p99_ms']:.1f} ms{got}"
        )


def _depth(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    means = {(row["method"], row["case"]): row for row in data["means"]}
    scenes = Counter(row["case"] for row in data["rows"] if row["method"] == "sgbm")
    anchor = "tuned OpenCV"

    def quality(method: str, case: str) -> str:
        row = means[method, case]
        return f"{row['bad2']:.2f} / {row['fill2']:.2f} / {row['density']:.1f} %"

    for method in ("tandem", "sgbm"):
        for case, count in scenes.items():
            what = f"`{method}`, {case}, {count} scenes: bad2 / fill2 / density"
            yield Figure(what, quality(method, case), f"{anchor}: {quality(anchor, case)}")
    what = f"`block`, the paper's matcher, all {scenes.total()} cases: bad2 / fill2 / density"
    yield Figure(what, quality("block", ""), f"{anchor}: {quality(anchor, '')}")
    for method in ("tandem", "sgbm", "block"):
        took, beside = (
            f"{_number(row['ms_per_mp'])} ms, CPU {_number(row['cpu_ms_per_mp'])} ms"
            for row in (means[method, ""], means[anchor, ""])
        )
        yield Figure(f"`{method}`, time for a megapixel, mean of the cases", took, f"{anchor}: {beside}")


def _matcher(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for row in data["rows"]:
        ours, theirs = (
            f"{_number(row[who]['wall_ms'])} ms, CPU {_number(row[who]['cpu_ms'])} ms" for who in ("ours", "theirs")
        )
        above = (
            f"; {row['ours']['cpu_ms'] / row['limit_ms'] / 2:.1f} times the arithmetic limit" if row["limit_ms"] else ""
        )
        yield Figure(
            f"`{data['matcher']}`, {row['part']}, {row['setting']}", ours + above, f"{row['anchor']}: {theirs}"
        )


def _demo(data: Data) -> Iterator[Figure]:
    truth, delays = data["truth"], data["delays_ms"]
    yield Figure("median depth error", f"{truth['depth_mm']:.1f} mm ({truth['depth_percent']:.2f} %)")
    for metres in (1, 2):
        yield Figure(f"median depth error at {metres} m", f"{truth[f'at_{metres}_m_mm']:.1f} mm")
    yield Figure("median disparity error", f"{truth['disparity_px']:.3f} px")
    yield Figure("pixels with a value, of those that both cameras see", f"{100 * truth['density']:.1f} %")
    for name in ("propagation", "queuing", "processing", "end_to_end"):
        both = f"{_number(delays[name]['p50'])} / {_number(delays[name]['p95'])} ms"
        yield Figure(f"{name.replace('_', '-')} delay of a pair, p50 / p95", both)


def _sizes(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for row in data["rows"]:
        what = (
            f"{row['size']}: time; CPU time; peak memory; pixels with a value; values off by more than 2 % of the depth"
        )
        times = f"{_number(row['seconds'])} s; {_number(row['cpu_seconds'])} s; {row['megabytes']:.0f} MB"
        yield Figure(what, f"{times}; {row['density']:.1f} %; {row['wrong']:.2f} %")


_PUBLISHED_RIG: Final = "published with the images"
_PUBLISHED_RMS_PX: Final = 0.189
_PUBLISHED_BASELINE_MM: Final = 80.17
"""rig.json of simplestereo_rig1: its RMS over all 30 pairs, and the length of T."""

_OPENCV_RMS_PX: Final = 0.215
"""README of $SCAN_DATA: cv2.stereoCalibrate on the same pairs."""


def _calibration(data: Data, rms: str, baseline: str) -> Iterator[Figure]:
    pairs, rows = data["pairs"], data["vertical_error_px"]
    yield Figure("pairs used, of those with a board", f"{pairs['used']} of {pairs['found']}")
    yield Figure("RMS stereo", f"{data['rms_px']['stereo']:.3f} px", rms)
    if baseline:
        found = f"{data['baseline_mm']:.2f} mm, sigma {data['baseline_sigma_mm']:.2f} mm"
        yield Figure("baseline", found, baseline)
    yield Figure("vertical error after rectification, mean / 95 %", f"{rows['mean']:.2f} / {rows['p95']:.2f} px")
    yield Figure("verdict of the command", data["verdict"])


def _published(data: Data) -> Iterator[Figure]:
    rms = f"{_PUBLISHED_RIG}, over 30 pairs: {_PUBLISHED_RMS_PX} px"
    return _calibration(data, rms, f"{_PUBLISHED_RIG}: {_PUBLISHED_BASELINE_MM} mm")


def _opencv_images(data: Data) -> Iterator[Figure]:
    """The side length of its squares is unknown, so its millimetres mean nothing."""
    return _calibration(data, f"OpenCV's stereoCalibrate, in a run of its own: {_OPENCV_RMS_PX} px", "")


def _rigs(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for row in data["real"]:
        name = f"{row['rig']}{', unlike' if row['is_unlike'] else ''}"
        yield Figure(
            f"{name}: pairs used; RMS stereo; rows p95; baseline",
            f"{row['used']} of {row['pairs']}; {row['rms_px']:.3f} px; {row['p95_px']:.2f} px;"
            f" {row['baseline_mm']:.2f} +- {row['baseline_sigma_mm']:.2f} mm",
            f"stereo_calib: {_recipe(row['recipe'])}, from our corners: {_recipe(row['recipe_on_ours'])}",
        )


def _recipe(found: Data) -> str:
    return f"{found['used']}; {found['rms_px']:.3f} px; {found['vertical_p95_px']:.2f} px; {1e3 * found['baseline_m']:.2f} mm"


def _corners(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for name, found in data["rows"].items():
        beside = ", ".join(f"{who}: {found[who]['rms_px']:.3f} px" for who in ("cornerSubPix", "sectors"))
        yield Figure(f"{name}: error of a corner, RMS", f"{found['ours']['rms_px']:.3f} px", beside)


_TRANSPORTS: Final = {
    "tandemscan": "tandemscan over tcp, after ten seconds",
    "tandemscan-steady": "tandemscan over tcp, after the first minute",
    "tandemscan-curve": "tandemscan over tcp with keys",
    "tandemscan-ipc": "tandemscan over ipc",
    "pyzmq": "bare pyzmq PUSH/PULL",
    "tcp": "bare TCP socket",
    "imagezmq": "imagezmq REQ/REP",
}


def _link(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for payload, found in data["payloads"].items():
        for name, row in found["transports"].items():
            what = f"{_TRANSPORTS[name]}, {payload} of {found['bytes'] / 1000:.0f} KB: one-way p50 / p99; CPU a frame of sender / receiver; lost"
            times = f"{_number(row['p50_us'])} / {_number(row['p99_us'])} us; {_number(row['sender_us'])} / {_number(row['receiver_us'])} us; {row['lost_frames']}"
            yield Figure(what, times)


def _serial(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    speeds = {name: statistics.median(run[0] for run in runs) for name, runs in data["pty"].items()}
    rivals = {"cobs": "COBS + CRC-32", "length": "length + CRC-32"}
    beside = ", ".join(f"bare loop with {rivals[name]}: {_number(speeds[name])}" for name in speeds if name in rivals)
    yield Figure("throughput over a pseudo terminal, frames of 50 KB", f"{_number(speeds['ours'])} MB/s", beside)
    for name, row in data["slow"].items():
        yield Figure(f"{name}, frames of 25 KB; lost", f"{row['frames_per_s']:.2f} a second; {row['lost']}")


def _switches(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for way, beside in (("pulled", ""), ("silent", "known as lost after 1500 ms")):
        rows = [row for row in data["rows"] if row["way"] == way]
        there, back = ([pause for row in rows for pause in row[side]] for side in ("there_ms", "back_ms"))
        what = (
            f"cable {way}, {len(there)} times: longest pause to the other link / longest on the way back; lost a switch"
        )
        lost = max(row["lost"] for row in rows)
        yield Figure(what, f"{max(there):.0f} / {max(back):.0f} ms; {_number(lost)}", beside)


def _clock(data: Data) -> Iterator[Figure]:
    early_us, late_us = data["real_limits_us"]
    for row in data["real"]:
        what = f"two processes, loopback TCP, {row['load']}, {row['scheduling']}: error p99"
        for when, moment, limit_us in (("early", "after 1 s", early_us), ("late", "after 10 s", late_us)):
            found = f"{_number(row[f'{when}_p99_us'])} us"
            yield Figure(f"{what} {moment}", found, "", f"at most {limit_us:g} us", moment not in row["missed"])
    for row in data["simulated"]:
        what, target = f"simulated, {row['name']}: error p99 after", row["target_us"]
        missed = [said for said in row["missed"] if "holdover" not in said]
        anchor = f"min-RTT: {_number(row['least_p99_us'])} us, mean: {_number(row['mean_p99_us'])} us"
        wanted = [] if target is None else [f"at most {target:g} us"]
        limit = ", ".join([*wanted, *(f"not {said}" for said in missed if "error p99" not in said)])
        yield Figure(f"{what} 10 s", f"{_number(row['p99_us'])} us", anchor, limit, not missed)
        if not math.isnan(row["held_p99_us"]):
            held, reached = f"{_number(row['held_p99_us'])} us", len(missed) == len(row["missed"])
            yield Figure(f"{what} 60 s without echoes", held, "", f"at most {data['held_limit_us']:g} us", reached)
    violations = sum(row["violations"] for row in data["simulated"])
    yield Figure("simulated: estimates beyond the bound that they state", str(violations), "", "0", violations == 0)


def _pairing(data: Data) -> Iterator[Figure]:
    rivals = ("ApproximateTime", "naive nearest")
    for regime in dict.fromkeys(row["regime"] for row in data["rows"]):
        rows = [row for row in data["rows"] if row["regime"] == regime]
        ours = [row for row in rows if row["method"] == "tandemscan"]
        pairs, wait_ms = min(row["pairs"] for row in ours), max(row["wait_p99_ms"] for row in ours)
        figure = f"{_percent(pairs)}; {sum(row['beyond'] for row in ours)}; {_number(wait_ms)} ms"
        least = {name: min(row["pairs"] for row in rows if row["method"] == name) for name in rivals}
        anchor = ", ".join(f"{name}: {_percent(share)}" for name, share in least.items())
        wanted = "100 %; 0; 1 ms" if "further apart than twice" in regime else "99 %; 0; one period"
        missed = sorted({f"not {what}" for row in ours for what in row["missed"]})
        what = f"{regime}: pairs of the best possible; beyond the tolerance; wait p99"
        yield Figure(what, figure, anchor, ", ".join([wanted, *missed]), not missed)


def _percent(share: float) -> str:
    return f"{100 * share:.2f} %"


def _age(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for row in data["rows"]:
        link, pipeline = (_time(row[place][1]["p95_ms"]) for place in ("link", "pipeline"))
        what = f"{row['name']}: age p95 at the link / at the pipeline, last 5 s; camera's frames a second"
        yield Figure(what, f"{link} / {pipeline}; {row['camera_hz']:.1f}")


def _time(ms: float) -> str:
    return f"{_number(ms)} ms" if ms < 1000 else f"{_number(ms / 1000)} s"


def _board(data: Data) -> Iterator[Figure]:
    yield from _verdicts(data)
    for name, costs in data["costs"].items():
        frames = sum(cost["frames"] for cost in costs)
        cpu_ms = sum(cost["cpu_ns"] for cost in costs) / max(1, frames) / 1e6
        resident_mb = max(cost["resident_bytes"] for cost in costs) / 1e6
        yield Figure(f"{name}: CPU time a frame; resident memory", f"{cpu_ms:.2f} ms; {resident_mb:.1f} MB")
    scheduling = "SCHED_FIFO" if data["quiet"] else "ordinary scheduling"
    yield Figure(
        f"for orientation: 10^6 rounds of `x += i` in the emulated board, {scheduling}",
        f"{1000 * data['interpreter_s']:.0f} ms",
    )


_CALIBRATE: Final = 'phone-host calibrate "$SCAN_DATA/{left}" "$SCAN_DATA/{right}" --board {board} --square {square} --out out/figures/{name}/rig.yaml --json'
_BENCH: Final = "python -m tests.bench."

SOURCES: Final = (
    Source("depth", Topic.DEPTH, "Real pairs with ground truth, clean and as cheap cameras give them. bad2: values that are off by more than 2 px. fill2: the same, each gap filled from its row. density: pixels with a value.", f"{_BENCH}bench_depth --json", _depth, 20),
    Source("accuracy", Topic.DEPTH, "The default matcher beside both of OpenCV's tuned recipes: the same pairs, rendered rooms with hardly any texture, boards of real rigs.", f"{_BENCH}bench_accuracy --json", _verdicts, 100),
    Source("matcher", Topic.DEPTH, "The default matcher's time beside OpenCV's, in turns, on two threads.", f"{_BENCH}bench_matcher --json", _matcher, 60),
    Source("demo", Topic.DEPTH, "The demo: a rendered scene of known depth, both programs live.", "phone-host demo --out out/figures/demo --json", _demo, 40),
    Source("sizes", Topic.DEPTH, "Photographs of a rendered scene through `phone-host stereo` and a rig, from start to exit. Time counts other jobs of the machine, CPU time does not.", f"{_BENCH}bench_sizes --quick --json", _sizes, 150),
    Source("scan", Topic.SCAN, "Sequences of others: a street's pairs by odometry alone, a depth camera's clip of a room through the tracker, whole and thinned out, a stereo rig at rest.", f"{_BENCH}bench_scan --runs 3 --seeds 5 --json", _verdicts, 150),
    Source("object", Topic.SCAN, "Rendered things on the mat, seen by two unlike cameras with blur, noise and JPEG: where the mat is found, and how far the model is from the true surface. The last rows: on a turntable, without a mat.", f"{_BENCH}bench_object --poses 4 --sizes VGA --json", _verdicts, 420),
    Source("scan-error", Topic.SCAN, "Whether the stated surface error of a scan holds, where it includes drift: rendered things on the mat, on a table, in a free scan and on a turntable. inside: share of the points within two stated deviations; times as wide: as the deviations that 95 % of the points need.", f"{_BENCH}bench_scan_error --objects bunny,bottle --views 24 --json", _verdicts, 600),
    Source("rig1", Topic.CALIBRATION, "A published rig, 1280x720.", _CALIBRATE.format(left="simplestereo_rig1/calib/*_L.png", right="simplestereo_rig1/calib/*_R.png", board="7x6", square="60.5mm", name="rig1"), _published, 20),
    Source("opencv", Topic.CALIBRATION, "OpenCV's example images, 640x480. The side of the squares is unknown.", _CALIBRATE.format(left="opencv_stereo_calib/left*.jpg", right="opencv_stereo_calib/right*.jpg", board="9x6", square="25mm", name="opencv"), _opencv_images, 10),
    Source("rigs", Topic.CALIBRATION, "Real rigs, the same made unlike (right images cropped, scaled by 0.6, re-exposed, compressed again), and ten rendered rigs whose truth is known, beside OpenCV's `stereo_calib` recipe.", f"{_BENCH}bench_calibration --json", _rigs, 90),
    Source("corners", Topic.CALIBRATION, "Corners of rendered chessboards. `cornerSubPix` starts where ours does; `sectors` is OpenCV's findChessboardCornersSB.", f"{_BENCH}bench_corners --json", _corners, 60),
    Source("causes", Topic.CALIBRATION, "Series of board views with one mistake each, and good ones: is the cause named?", f"{_BENCH}bench_causes --json", _verdicts, 300),
    Source("guide", Topic.CALIBRATION, "A simulated novice who follows the words of `calibrate --live`, with two painted cameras and a real link.", f"{_BENCH}bench_guide --jobs 2 --json", _verdicts, 900),
    Source("page", Topic.PAGE, "A run with `--serve`, with nobody, with readers of 20 KB/s and with viewers that show every pair, in turn.", f"{_BENCH}bench_page --json", _page, 400),
    Source("drift", Topic.CALIBRATION, "A rig that turns while it runs, and rigs that stand.", f"{_BENCH}bench_drift --json", _verdicts, 600),
    Source("browser", Topic.PAGE, "Stamps of a browser's camera against the moment at which Chromium's fake camera read the image from its file.", f"{_BENCH}bench_browser --json", _verdicts, 150),
    Source("capture", Topic.CALIBRATION, "Films with and without stabilisation, told apart.", f"{_BENCH}bench_capture --json", _verdicts, 300),
    Source("measure", Topic.DEPTH, "Points of rendered rooms, measured as `phone-host measure` does: does the truth lie within what is stated?", f"{_BENCH}bench_measure --json", _verdicts, 300),
    Source("quality", Topic.DEPTH, "A rendered wall, measured as `phone-host quality` does, beside what the exact disparity and depth of every pixel give.", f"{_BENCH}bench_quality --json", _verdicts, 60),
    Source("link", Topic.LINKS, "640x480 JPEGs at 30 per second between two processes, all transports in turns.", f"{_BENCH}bench_link --runs 2 --seconds 4 --payloads jpeg --transports {' '.join(_TRANSPORTS)} --json", _link, 270),
    Source("serial", Topic.LINKS, "Serial lines: a pseudo terminal, and emulated slow cables.", f"{_BENCH}bench_serial --runs 2 --seconds 10 --json", _serial, 80),
    Source("switches", Topic.LINKS, "The better of two links is lost and comes back.", f"{_BENCH}bench_links --losses 2 --json", _switches, 70),
    Source("clock", Topic.CLOCK, "How well the host knows the board's clock. Why radio misses its figure without echoes: [decision 0009](decisions/0009-clock-estimate.md).", f"{_BENCH}bench_clock --runs 400 --long-runs 40 --real-runs 1 --json", _clock, 230),
    Source("pairing", Topic.PAIRING, "Random streams of two cameras, 0 to 10 % of the frames lost, beside the best possible pairs. The worst of the losses is told.", f"{_BENCH}bench_pairing --streams 200 --json", _pairing, 50),
    Source("age", Topic.AGE, "A host ten times slower than the camera: how old are the frames that it gets?", f"{_BENCH}bench_age --seconds 15 --json", _age, 75),
    Source("recording", Topic.RECORDINGS, "A recording of 2 x 30 images of 51 KB a second, files with damages, runs with and without `--record` in turn, and replays.", f"{_BENCH}bench_recording --json", _verdicts, 400),
    Source("recording-memory", Topic.RECORDINGS, "Ten minutes of 2 x 30 images a second recorded, then replayed on demand: memory of each program, without pages of the file.", f"{_BENCH}bench_recording --parts memory --json", _verdicts, 1000),
    Source("board", Topic.BOARD, "A booted virtual board (armhf, emulated) with a 640x480 MJPEG webcam at 30 per second.", f"{_BENCH}bench_board --runs 1 --seconds 8 --json", _board, 180),
)  # fmt: skip
"""Everything on the page."""
