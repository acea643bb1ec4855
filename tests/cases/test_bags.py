"""Bags of ROS 1 and folders of rosbag2, written by the library rosbags: in each storage and compression."""

from pathlib import Path

import numpy as np
import pytest

from common.recording.opened import open_recorded
from phone_host.cli import main
from phone_host.recording.both_sides import encoded
from phone_host.stereo.raw_images import decode_frame
from tests.support.foreign_bags import BAGS, PAIRS
from tests.support.foreign_recordings import PERIOD_NS, ZERO_NS, picture


@pytest.mark.parametrize("name", BAGS)
def test_bags_become_recordings(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """`import` takes every picture with its pixels and stamp, and tells the topic that it does not use; `info` reads the bag itself."""
    bag, out = tmp_path / "a.bag", tmp_path / "out.mcap"
    BAGS[name](bag)
    for words in (["info", str(bag)], ["import", str(bag), "--out", str(out)]):
        assert main(["sessions", *words]) == 0
        assert "not used: /words (std_msgs/msg/String is no image)" in capsys.readouterr().out
    found = open_recorded(out)
    for side, topic in enumerate(("/left/image/compressed", "/right/image/compressed")):
        shown = found.images[topic]
        assert [each.image.stamp_ns for each in shown] == [ZERO_NS + n * PERIOD_NS for n in range(PAIRS)]
        for number, each in enumerate(shown):
            pixels = decode_frame(encoded(each, found.camera(topic), "an image"))
            assert np.array_equal(pixels, picture(side, number))


@pytest.mark.parametrize("name", BAGS)
def test_damaged_bags_are_one_line(tmp_path: Path, name: str, capsys: pytest.CaptureFixture[str]) -> None:
    """Cut in the middle: exit 4 and one line with the bag's name, or what is whole; never more than that."""
    bag, out = tmp_path / "a.bag", tmp_path / "out.mcap"
    BAGS[name](bag)
    for file in [path for path in bag.iterdir() if path.suffix != ".yaml"] if bag.is_dir() else [bag]:
        content = file.read_bytes()
        file.write_bytes(content[: len(content) // 2])
    code = main(["sessions", "import", str(bag), "--out", str(out)])
    printed = capsys.readouterr()
    if code:
        [line] = printed.err.splitlines()
        assert code == 4
        assert str(bag) in line
        assert not out.exists()
    else:
        assert "mcap" in name
