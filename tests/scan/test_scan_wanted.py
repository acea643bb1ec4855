"""What is wanted of a scan: the page's words mean what the command's options mean, and what does not go together is refused in one line."""

from pathlib import Path

import pytest

from common.errors import SettingsError
from phone_host import api
from phone_host.cli import main
from phone_host.cli import parser as parser_of
from phone_host.model import UnseenSurface
from phone_host.scan.field_bytes import field_bytes, field_of
from phone_host.scan.mat import USUAL_MAT, parse_mat
from phone_host.scan.mat_tracker import MatPoses
from phone_host.scan.pose_source import TablePoses, VisualPoses
from phone_host.scan.turntable import TurntablePoses
from phone_host.scan.volume import Volume
from phone_host.scan.volume_settings import VolumeSettings
from phone_host.serve.choices import asked_scan
from tests.support.requests import verbs_of


def test_the_page_wants_what_the_command_wants() -> None:
    """Nothing, a mat, or a turntable with a box: each is read by the command's own options."""
    assert (asked_scan({}).mat, asked_scan({}).turntable, asked_scan({}).onto) == (None, False, None)
    assert asked_scan({"mat": USUAL_MAT, "box": " "}).mat == parse_mat(USUAL_MAT)
    assert asked_scan({}).unseen is UnseenSurface.FILL
    assert asked_scan({"unseen": "cut"}).unseen is UnseenSurface.CUT
    with pytest.raises(SettingsError, match="unseen is 'gone'"):
        asked_scan({"unseen": "gone"})
    turned = asked_scan({"turntable": "1", "voxel": "2mm", "box": "400x300x400@0,100,900"})
    assert (turned.turntable, turned.voxel_m, turned.box is not None) == (True, 0.002, True)
    with pytest.raises(SettingsError, match="--turntable beside --mat"):
        asked_scan({"turntable": "1", "mat": USUAL_MAT})


@pytest.mark.parametrize("verb", ["scan", "export"])
def test_unseen_takes_each_choice_and_no_other(verb: str) -> None:
    """Scan and export offer the values of the choice, in its order."""
    parser = verbs_of(parser_of())[verb]
    assert f"--unseen {{{','.join(each.value for each in UnseenSurface)}}}" in parser.format_help()


def test_the_python_api_takes_one_way_and_begins_it() -> None:
    """What contradicts itself is refused; `scan_for` takes the poses from what was asked for."""
    for wrong in ({"turntable": True, "on_table": True}, {"mat": parse_mat(USUAL_MAT), "turntable": True}):
        with pytest.raises(SettingsError, match="ask for one of"):
            api.ScanWanted(**wrong)
    empty = Volume(VolumeSettings(voxel_m=0.01, far_m=1.0))
    with pytest.raises(SettingsError, match="onto without turntable"):
        api.ScanWanted(onto=field_of(field_bytes(empty), "field.bin"))
    ways = [api.ScanWanted(), api.ScanWanted(mat=parse_mat(USUAL_MAT)), api.ScanWanted(on_table=True)]
    kinds = [type(api.scan_for(wanted).poses) for wanted in (*ways, api.ScanWanted(turntable=True))]
    assert kinds == [VisualPoses, MatPoses, TablePoses, TurntablePoses]


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--mat", "--turntable"], "--turntable beside --mat"),
        (["--mat", "--onto", "."], "--onto without --turntable"),
        (["--mat", "--turntable", "--onto", "."], "--turntable beside --mat"),
        (["--turntable", "--resume", "."], "--resume beside --turntable"),
        (["--mat", "--axes", "y-up"], "--axes y-up beside --mat"),
    ],
)
def test_what_does_not_go_together_is_one_line(
    words: list[str], told: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit code 2, before any picture is read."""
    for side in ("l", "r"):
        (tmp_path / side).mkdir()
        for name in ("0.png", "1.png"):
            (tmp_path / side / name).write_bytes(b"")
    rig = ["--rectified", "--focal", "500", "--baseline", "60", "--out", str(tmp_path / "o")]
    assert main(["scan", str(tmp_path / "l"), str(tmp_path / "r"), *rig, *words]) == 2
    said = capsys.readouterr().err
    assert told in said
    assert len(said.strip().splitlines()) == 1
