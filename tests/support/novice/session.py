"""One guided calibration from start to verdict: both programs, a real link, two test cameras, and a novice who hears the words."""

import json
import signal
import subprocess
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from phone_host.calibration.solve.next_view import depth_sigma_m
from phone_host.geometry.se3 import vectors_of
from phone_host.model import Rig
from phone_host.output.rig_yaml import read_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.novice.camera import PLAN, registered
from tests.support.novice.depth_truth import depth_error_m, depths_in_places
from tests.support.novice.hands import write_plan
from tests.support.novice.head import Novice
from tests.support.novice.scene import BOARD, BOARDS, between_m, novice_scene
from tests.support.programs import Program, board, host, until

_STEP_S: Final = 0.02
_SAY, _TAKEN, _DONE = "say: ", "taken: ", "done"
_PATIENCE_S: Final = 180.0
_AWAY_M: Final = 1.0
_LEAST_SIGMA_M: Final = 0.001
"""Nobody is harmed by an error below this at 1 m, whatever is stated: a matcher's own is larger."""

_TURN: Final = slice(24, 27)
"""Where a rig's covariance has the turn of the right camera."""


@dataclass(frozen=True, slots=True)
class Errors:
    """How far a rig is from the truth, and how far it says that it may be (one standard deviation).

    Attributes:
        baseline_m: error of the baseline, m.
        baseline_sigma_m: stated.
        turn_rad: angle of the right camera's error, rad.
        turn_sigma_rad: stated.
        depth_m: error of depth at 1 m, root mean square over what both cameras see, m.
        depth_sigma_m: stated.
        places: depth at 1 m in the middle and in the four corners of what both cameras see: error and what is stated, m.
    """

    baseline_m: float
    baseline_sigma_m: float
    turn_rad: float
    turn_sigma_rad: float
    depth_m: float
    depth_sigma_m: float
    places: tuple[tuple[float, float], ...]

    @property
    def worst(self) -> float:
        """The largest error of depth, in standard deviations as they are stated."""
        pairs = [(self.depth_m, self.depth_sigma_m), *self.places]
        return max(abs(error) / max(sigma, _LEAST_SIGMA_M) for error, sigma in pairs)


@dataclass(frozen=True, slots=True, kw_only=True)
class Session:
    """How one session went.

    Attributes:
        seed: of the session.
        verdict: good, usable or reject, as the report says; empty: it was never said that all is done.
        views: how many were taken.
        seconds: from the start of phone-host until it says that it is done, s.
        refused: how many views were refused, by reason.
        said: what was said, with the time, s.
        skipped: frames that a camera could not paint in time, as a share.
        errors: against the truth; None: there is no rig.
        exit_code: of phone-host; None: it did not come to an end.
        log: the end of what it wrote.
    """

    seed: int
    verdict: str
    views: int
    seconds: float
    refused: dict[str, int]
    said: tuple[tuple[float, str], ...]
    skipped: float
    errors: Errors | None
    exit_code: int | None
    log: str


@dataclass(frozen=True, slots=True)
class Setting:
    """What a session is run with.

    Attributes:
        fps: of the left camera.
        patience_s: longest time, s; then the session is ended as failed.
        other_fps: of the right camera; None: as of the left one. If they differ, exposures drift through each other.
        is_free: whether the cameras cannot be steered, so that their exposures stay apart.
        kind: of board.
        more: further options of phone-host.
    """

    fps: int = 15
    patience_s: float = 300.0
    other_fps: int | None = None
    is_free: bool = False
    kind: str = "chessboard"
    more: tuple[str, ...] = ()


def run_session(seed: int, folder: Path, setting: Setting) -> Session:
    """Run one session in real time.

    Args:
        seed: of rig and person.
        folder: an empty one.
        setting: what it is run with.
    """
    folder.mkdir(parents=True, exist_ok=True)
    truth = novice_scene(seed).rig
    novice = Novice(np.random.default_rng([16, seed]), between_m(truth), time.monotonic())
    write_plan(folder / PLAN, novice.plan)
    more = registered(folder / "site")
    camera = f"novice:{folder}?seed={seed}&board={setting.kind}&steered={0 if setting.is_free else 1}"
    theirs = f"{camera}&side=left&fps={setting.fps}"
    ours = f"{camera}&side=right&fps={setting.other_fps or setting.fps}"
    link = f"ipc://{folder}/link"
    live = [
        "calibrate",
        "--live",
        "--link",
        link,
        "--camera",
        ours,
        "--no-sound",
        "--json",
        "--snapshots",
        str(folder),
    ]
    live += ["--board", BOARDS[setting.kind]] if setting.kind != "chessboard" else []
    live += ["--square", f"{BOARD.square_m * 1e3:g}mm"] if setting.kind == "chessboard" else []
    live += ["--out", str(folder / "rig.yaml"), *setting.more]
    with board(["run", "--camera", theirs, "--link", link], folder, more=more) as agent:
        until(lambda: "serving" in agent.stderr or agent.process.poll() is not None, "board-agent serves")
        with host(live, folder, more=more) as guide:
            began_s = time.monotonic()
            said = _talk(guide, novice, folder, began_s + setting.patience_s)
            took_s = time.monotonic() - began_s
            is_done = bool(said) and said[-1][1].startswith(_DONE)
            if not is_done and guide.process.poll() is None:
                guide.send(signal.SIGTERM)
            with suppress(subprocess.TimeoutExpired):
                guide.process.wait(_PATIENCE_S)  # it calibrates once more, from the saved pictures
            code, log = guide.process.poll(), guide.stderr
        agent.stop()
    report = _json(folder / "report.json") if code == 0 else {}
    return Session(
        seed=seed,
        verdict=str(report.get("verdict", "")) if is_done else "",
        views=sum(line.startswith(_TAKEN) for line in log.splitlines()),
        seconds=took_s,
        refused=_json(folder / "guide.json").get("refused", {}),
        said=tuple((round(at_s - began_s, 2), words) for at_s, words in said),
        skipped=_skipped(folder),
        errors=_errors(folder / "rig.yaml", truth),
        exit_code=code,
        log=log[-2000:],
    )


def _talk(guide: Program, novice: Novice, folder: Path, until_s: float) -> list[tuple[float, str]]:
    """Let the novice hear what is said, until it is said that all is done or the program ends."""
    said, read = list[tuple[float, str]](), 0
    while (
        not (said and said[-1][1].startswith(_DONE))
        and guide.process.poll() is None
        and (now_s := time.monotonic()) < until_s
    ):
        log = guide.err.read_bytes()
        whole = log.rfind(b"\n") + 1
        for line in log[read:whole].decode(errors="replace").splitlines():
            if line.startswith(_SAY):
                said.append((now_s, line.removeprefix(_SAY)))
                novice.hear(said[-1][1], now_s)
        read = max(read, whole)
        if novice.act(now_s):
            write_plan(folder / PLAN, novice.plan)
        time.sleep(_STEP_S)
    return said


def _json(path: Path) -> dict[str, Any]:
    return dict(json.loads(path.read_text())) if path.exists() else {}


def _skipped(folder: Path) -> float:
    counts = [_json(folder / f"{side}.json") for side in ("left", "right")]
    return max((each["skipped"] / (each["skipped"] + each["painted"]) for each in counts if each), default=float("nan"))


def _errors(path: Path, truth: Rig) -> Errors | None:
    if not path.exists():
        return None
    found = read_rig(path)
    baselines = [float(np.linalg.norm(each.t_right_left_m)) for each in (found, truth)]
    return Errors(
        baseline_m=baselines[0] - baselines[1],
        baseline_sigma_m=found.baseline_sigma_m,
        turn_rad=float(np.linalg.norm(vectors_of(found.R_right_left @ truth.R_right_left.T))),
        turn_sigma_rad=float(np.sqrt(np.trace(found.covariance[_TURN, _TURN]))),
        depth_m=depth_error_m(found, truth, _AWAY_M),
        depth_sigma_m=depth_sigma_m(found, rectify_rig(found), _AWAY_M),
        places=depths_in_places(found, truth, _AWAY_M),
    )
