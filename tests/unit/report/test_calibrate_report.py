"""report.json of calibrate, from the values that the summary and the page are made of."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from common.diagnostic import Diagnostic
from common.errors import DataError
from phone_host.calibration.failure_modes.mistakes import Course, Mistake, Turned, mistaken
from phone_host.calibration.guide.snapshot import before_board
from phone_host.calibration.solve.verdict import Assessment
from phone_host.model import Verdict
from phone_host.output.json_text import json_text
from phone_host.output.rig_files.imported import Imported, RigKind
from phone_host.report.calibration_report import Exported, ImportReport, Judged
from phone_host.report.calibration_result import calibration_values, import_values
from tests.support.calibration_series import calibration, calibration_report
from tests.support.rigs import unlike_rig

_USABLE = Assessment(Verdict.USABLE, "take more")
_DOCS = Path(__file__).resolve().parents[3] / "docs" / "files.md"


def _turned() -> Diagnostic:
    turned = Turned(
        course=Course.KNOCK,
        turn_rad=np.array([0.001, 0.0, 0.0]),
        sigma_rad=np.full(3, 1e-4),
        begins=1,
        names=("4", "5"),
        turns_rad=np.zeros((2, 3)),
        lens=unlike_rig().right,
        rows_px=0.7,
        depth_at_1_m_m=0.012,
    )
    return mistaken(Mistake.UNSTIFF, "they turned", "tighten it", turned=turned)


def test_every_key_is_documented() -> None:
    """A rig with all that can be told of one, one without a cause, no rig at all, and an imported one: docs/files.md lists each key of their reports."""
    section = _DOCS.read_text(encoding="utf-8").split("\n## report.json of `calibrate`\n")[1].split("\n## ")[0]
    listed = set(re.findall(r"`(\w+)`", section)) | {"format_version", "command"}
    whole = replace(
        calibration_report(Judged(calibration(), _USABLE, _turned())),
        earlier_rig="rig.yaml.old",
        exported=(Exported(RigKind.ROS, (Path("ros/left.yaml"),)),),
        live=before_board("show", 25, 1.0),
    )
    for values in (
        calibration_values(whole),
        calibration_values(calibration_report(Judged(calibration(), _USABLE))),
        calibration_values(calibration_report(DataError("nothing is seen", "light it"))),
        import_values(ImportReport(imported=Imported(rig=unlike_rig(), kind=RigKind.ROS, files=(), notes=()))),
    ):
        assert set(values) <= listed
        assert json_text(values)


def test_a_cause_is_told_with_its_turn() -> None:
    """Name, sentence and remedy; degrees, millimetres and the pair from which on the cameras stood otherwise. A hint comes before the sentence; no cause is null."""
    values = calibration_values(calibration_report(Judged(calibration(), _USABLE, _turned())))["cause"]
    assert (values["name"], values["sentence"], values["remedy"]) == ("rig not stiff", "they turned", "tighten it")
    assert values["explained_px"] is None
    assert values["turned"]["course"] == "at once"
    assert values["turned"]["turn_deg"][0] == pytest.approx(math.degrees(0.001), abs=1e-4)
    assert (values["turned"]["from_pair"], values["turned"]["depth_at_1_m_mm"]) == ("5", 12.0)
    turned = Judged(calibration(), _USABLE, _turned(), "the right images are turned")
    assert calibration_values(calibration_report(turned))["cause"]["sentence"] == "the right images are turned"
    assert calibration_values(calibration_report(Judged(calibration(), _USABLE)))["cause"] is None


def test_no_rig_is_a_rejected_one() -> None:
    """Problem and remedy are those of the error; no pair is used, and there are no figures."""
    report = calibration_report(DataError("nothing is seen", "light it"))
    values = calibration_values(report)
    assert (report.verdict, report.remedy) == (Verdict.REJECT, "light it")
    assert (values["verdict"], values["problem"], values["remedy"]) == ("reject", "nothing is seen", "light it")
    assert values["pairs"]["used"] == 0
    assert [each["pair"] for each in values["pairs"]["rejected"]] == ["8", "left9.png"]
    assert "baseline_mm" not in values
