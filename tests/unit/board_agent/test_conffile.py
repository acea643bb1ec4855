"""The package's settings file: every setting with its comment, and nothing that board-agent would refuse."""

import re
from dataclasses import fields
from pathlib import Path

from board_agent.settings import ENVIRONMENT_PREFIX, BoardSettings
from common.camera.factory import parse_camera
from common.link.factory import needs_keys, parse_link
from common.program.settings import resolve

CONFFILE = Path(__file__).resolve().parents[3] / "deploy" / "board" / "board-agent.toml"


def test_every_setting_stands_there_with_a_comment_above() -> None:
    """The keys are exactly those of BoardSettings, and the line before each is a comment."""
    lines = CONFFILE.read_text(encoding="utf-8").splitlines()
    above = {line.partition(" = ")[0]: lines[at - 1] for at, line in enumerate(lines) if re.match(r"\w+ = ", line)}
    assert set(above) == {field.name for field in fields(BoardSettings)}
    assert all(line.startswith("#") for line in above.values())


def test_its_values_and_examples_are_understood() -> None:
    """The values and every quoted URI in the comments are accepted; as delivered, nobody outside the machine gets in."""
    settings = resolve(BoardSettings, ENVIRONMENT_PREFIX, CONFFILE, {}).values
    assert not any(needs_keys(parse_link(uri, listens_by_default=True)) for uri in settings.link)
    quoted = re.findall(r'"([^"\s]+:[^"\s]+)"', CONFFILE.read_text(encoding="utf-8"))
    cameras = [uri for uri in quoted if uri.startswith(("v4l2:", "replay:"))]
    links = [uri for uri in quoted if uri not in cameras]
    for uri in cameras:
        parse_camera(uri, "")
    schemes = {parse_link(uri, listens_by_default=True).address.partition(":")[0] for uri in links}
    assert len(cameras) > 3
    assert schemes == {"tcp", "ipc", "serial", "rfcomm"}
    assert settings.wait_for_camera
