"""The host doctor's own verdicts: Python, packages, rig and the board's answer."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from common.diagnostic import Diagnostic, Severity
from common.doctor.finding import fail
from common.errors import SettingsError
from phone_host.cli import main
from phone_host.doctor.host_checks import (
    Answer,
    BoardReadings,
    Package,
    check_board,
    check_native,
    check_out,
    check_package,
    check_ports,
    check_python,
)
from phone_host.doctor.rig_checks import RigReadings, check_rig
from phone_host.doctor.vision_checks import read_rig_readings
from phone_host.model import Verdict
from phone_host.native.library import native
from phone_host.output.rig_yaml import write_rig
from phone_host.stereo.rectify import rectify_rig
from tests.support.rigs import unlike_rig

OK, WARN, FAIL = Severity.OK, Severity.WARN, Severity.FAIL


@pytest.mark.parametrize(("version", "verdict"), [((3, 11, 0), OK), ((3, 14, 1), OK), ((3, 10, 12), FAIL)])
def test_python_must_be_3_11(version: tuple[int, int, int], verdict: Severity) -> None:
    """Older interpreters fail."""
    assert check_python(version, "linux").severity is verdict


@pytest.mark.parametrize(
    ("package", "verdict", "word"),
    [
        (
            Package(
                name="cv2", version="4.10.0", problem="", least="4.10", below="5", wheels=("opencv-python-headless",)
            ),
            OK,
            "4.10.0",
        ),
        (Package(name="cv2", version="4.9.0", problem="", least="4.10", below="5"), WARN, "4.10 or newer"),
        (Package(name="cv2", version="5.0.0-pre", problem="", least="4.10", below="5"), WARN, "below 5"),
        (
            Package(name="cv2", version="", problem="ImportError: libGL.so.1", least="4.10", below="5"),
            FAIL,
            "libGL.so.1",
        ),
        (
            Package(
                name="cv2",
                version="4.10.0",
                problem="",
                least="4.10",
                below="5",
                wheels=("opencv-python-headless", "opencv-python"),
            ),
            FAIL,
            "pip uninstall opencv-python,",
        ),
        (Package(name="numpy", version="1.26.4", problem="", least="1.24"), OK, "1.26.4"),
    ],
)
def test_packages_are_judged_by_version_and_company(package: Package, verdict: Severity, word: str) -> None:
    """In range is fine, out of range warns, broken or installed twice fails; the remedy keeps the headless wheel."""
    finding = check_package(package)
    assert finding.severity is verdict
    assert word in finding.message + finding.remedy


@pytest.mark.parametrize(
    ("rig", "verdict", "word"),
    [
        (RigReadings("rig.yaml", rms_px=0.2, baseline_m=0.1, host_size_px=(640, 480)), OK, "100.0 mm"),
        (RigReadings("rig.yaml", baseline_m=0.1, host_size_px=(640, 480)), OK, "640x480"),
        (RigReadings("rig.yaml", rms_px=2.5, baseline_m=0.1, host_size_px=(640, 480)), WARN, "2.50 px"),
        (
            RigReadings("rig.yaml", rms_px=0.2, baseline_m=0.1, host_size_px=(640, 480), is_rejected=True),
            WARN,
            "calibrate again",
        ),
        (
            RigReadings("rig.yaml", baseline_m=0.1, host_size_px=(640, 480), asked_size_px=(1280, 720)),
            FAIL,
            "size=640x480",
        ),
        (RigReadings("rig.yaml", fail("rig", "rig.yaml: T is 80 m long", "T is in metres")), FAIL, "metres"),
    ],
)
def test_a_rig_must_be_sound_and_fit_the_camera(rig: RigReadings, verdict: Severity, word: str) -> None:
    """A good rig names its baseline; a bad file, another image size or a large error is reported with the remedy."""
    finding = check_rig(rig)
    assert finding.severity is verdict
    assert word in finding.message + finding.remedy


@pytest.mark.parametrize("answer", Answer)
def test_every_answer_of_a_board_is_judged(answer: Answer) -> None:
    """Only a board that answers is fine, a busy one warns, anything else fails with a remedy."""
    finding = check_board(
        BoardReadings(
            uri="tcp://board:5555",
            answer=answer,
            waited_s=5.0,
            camera="Cam",
            round_trip_ns=400_000,
            uncertainty_ns=20_000,
        )
    )
    assert finding.severity is {Answer.BOARD: OK, Answer.BUSY: WARN}.get(answer, FAIL)
    assert bool(finding.remedy) is (answer is not Answer.BOARD)


def test_ports_and_folder() -> None:
    """No serial port is no fault, a missing pyserial fails, as does a folder that is not writable."""
    assert check_ports((), "").severity is OK
    assert check_ports((), "No module named 'serial'").severity is FAIL
    assert check_out("scan", "") == []
    assert check_out("/proc", "Permission denied")[0].severity is FAIL


def test_a_rig_files_verdict_reaches_the_doctor(tmp_path: Path) -> None:
    """A rig.yaml that says `reject` is warned of, one that says `good` is not."""
    rig = unlike_rig()
    for verdict, grade in ((Verdict.REJECT, WARN), (Verdict.GOOD, OK)):
        judged = replace(rig, verdict=verdict)
        write_rig(tmp_path / "rig.yaml", judged, rectify_rig(judged))
        assert check_rig(read_rig_readings(str(tmp_path / "rig.yaml"), "")).severity is grade


def test_a_missing_native_library_is_a_warning_with_its_reason() -> None:
    """Everything works without it; a wrong TANDEMSCAN_SIMD stops every command, so that fails; the library's instructions are named."""
    missing = check_native(Diagnostic(message="not built: no C compiler", remedy="install gcc"))
    assert (missing.severity, missing.remedy) == (WARN, "install gcc")
    assert missing.message == "own matcher not built: no C compiler; sgbm is used, six times the work for each pair"
    idle = check_native(Diagnostic(message="not built", remedy="install gcc"), "avx2")
    assert (
        idle.message
        == "own matcher not built; sgbm is used, six times the work for each pair; TANDEMSCAN_SIMD=avx2 has no effect"
    )
    assert check_native(SettingsError("TANDEMSCAN_SIMD=mmx is no instruction set", "give scalar")).severity is FAIL
    found = check_native(native())
    assert found.severity is OK
    assert found.message.startswith("own matcher: ")


def test_a_link_that_cannot_be_opened_fails(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The board's check fails with the link's own words, and the exit code is that of a failed check."""
    assert main(["doctor", "--link", f"serial:{tmp_path}/tty", "--wait", "1", "--json"]) == 4
    checks = {check["what"]: check for check in json.loads(capsys.readouterr().out)["checks"]}
    assert checks["board"]["verdict"] == "fail"
    assert "cannot be opened" in checks["board"]["finding"]
