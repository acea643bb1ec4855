"""phone-host doctor: check settings, Python, camera, link, rig and disk."""

from dataclasses import dataclass
from pathlib import Path

from common.diagnostic import Severity
from common.doctor.finding import exit_code, settings_finding, table, values
from common.errors import SettingsError
from common.program.quantities import seconds
from common.program.request import Request, option
from common.program.terminal import fitted
from phone_host.camera.uris import EXAMPLE
from phone_host.declared_settings import PhoneHostSettings
from phone_host.doctor.host_doctor import Question, examine
from phone_host.output.data_folder import data_folder
from phone_host.output.json_text import json_text
from phone_host.settings import check, key_folder, resolve_settings

EXAMPLES = """  phone-host doctor
  phone-host doctor --link tcp://192.168.7.2:5555 --camera v4l2:/dev/video0 --calibration rig.yaml --out scan
  phone-host doctor --camera http://192.168.1.5:8080/video --calibration rig.yaml --capture    # hold it, turn it a little
  phone-host doctor --config phone-host.toml --json
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorRequest(Request):
    """What doctor can be told."""

    config: Path | None = option("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    link: tuple[str, ...] | None = option(
        "--link",
        action="append",
        metavar="URI",
        help="address of the board to check; repeat the option for several links",
    )
    camera: str | None = option(
        "--camera", metavar="URI", help="camera of this machine; the check streams from it for a second"
    )
    calibration: str | None = option("--calibration", metavar="FILE", help="rig.yaml to check")
    capture_s: float | None = option(
        "--capture",
        number=seconds,
        nargs="?",
        const=60.0,
        metavar="S",
        help="film with --camera for S seconds (default 60) and judge rate, stamps, shutter, and whether its software warps the"
        " images; kept as capture.json beside --calibration, or among your data until there is one",
    )
    out: Path = option(
        "--out",
        type=Path,
        default=Path(),
        metavar="DIR",
        help="folder for results; the check looks for free space there (default: the current folder)",
    )
    keys: str | None = option(
        "--keys", metavar="DIR", help="folder of keys, with which the board is asked (default ~/.config/tandemscan)"
    )
    wait_s: float = option(
        "--wait", number=seconds, default=5.0, metavar="S", help="seconds to wait for the board (default 5)"
    )


def run(request: DoctorRequest) -> int:
    """Run the checks and print the findings. If the settings make no sense, that is the first finding, and the machine is checked by itself."""
    settings, wrong = PhoneHostSettings(), None
    try:
        resolved = resolve_settings(request.given).values
        check(resolved)
        settings = resolved
    except SettingsError as error:
        wrong = error
    question = Question(
        camera=settings.camera,
        links=settings.link,
        calibration=settings.calibration,
        out=request.out,
        wait_s=request.wait_s,
        keys=key_folder(settings.keys),
        data=data_folder(),
    )
    if request.capture_s is not None:
        _require_capture(request.capture_s, question)
    findings = [settings_finding(str(request.config or ""), wrong), *examine(question, keeps=request.capture_s is None)]
    found = values(findings)
    if request.capture_s is not None and all(each.severity is not Severity.FAIL for each in findings):
        from phone_host.output.capture_json import capture_values  # noqa: PLC0415 - numpy and OpenCV, seen to work
        from phone_host.verbs.doctor_capture import guided_capture  # noqa: PLC0415 - the same

        capture = guided_capture(question, request.capture_s)
        findings += capture.findings
        found = {**values(findings), "capture": capture_values(capture.report)}
    print(json_text(found) if request.as_json else fitted(table(findings)))
    return exit_code(findings, wrong)


def _require_capture(whole_s: float, question: Question) -> None:
    """Check what --capture needs.

    Raises:
        SettingsError: it lacks something.
    """
    if not 10 <= whole_s <= 600:
        raise SettingsError(f"--capture is {whole_s:g}", "give 10 to 600 seconds; 60 are usual")
    if not question.camera:
        raise SettingsError("--capture without --camera", f"add --camera {EXAMPLE}")
