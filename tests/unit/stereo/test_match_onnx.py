"""Learned matchers from ONNX files: what networks take and give is found out, and what does not fit is told in one line."""

import os
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

from common.errors import DataError, SettingsError, TandemError, UnavailableError
from phone_host.model import RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.match_onnx import OnnxMatcher
from phone_host.stereo.matcher_names import Check, Levels, NetworkMatcher, Sign, matcher_named, network_named
from tests.support.networks import Element, Form, Graph, block_network, value_info
from tests.support.planes import noise

pytest.importorskip("onnxruntime", reason="onnxruntime is not installed: pip install onnxruntime")

SHIFT_PX = 7


def _pair(width_px: int = 120, height_px: int = 60, by_px: int = SHIFT_PX, coarse_px: int = 3) -> RectifiedPair:
    wide = np.asarray(cv2.blur(noise(width_px + by_px, height_px, 3), (coarse_px, coarse_px)), np.uint8)
    return RectifiedPair(wide[:, :width_px], wide[:, by_px:])


def _colour(pair: RectifiedPair) -> RectifiedPair:
    """A pair whose red channel alone tells anything."""
    black = np.zeros_like(pair.left)
    left, right = (np.dstack([black, black, image]) for image in (pair.left, pair.right))
    return RectifiedPair(left, right)


def _matcher(path: Path, options: str = "", disparities: int = 12) -> OnnxMatcher:
    matcher = create_matcher(MatchSettings(matcher_named(f"onnx:{path}{options}"), disparities))
    assert isinstance(matcher, OnnxMatcher)
    return matcher


@pytest.mark.parametrize(
    ("form", "options"),
    [
        (Form(), ""),
        (Form(channels=3), ""),
        (Form(channels=3), "?input=bytes"),
        (Form(channels=3), "?input=imagenet"),
        (Form(), "?input=imagenet&check=no"),
        (Form(channels=3, channels_first=False), ""),
        (Form(channels_first=False), ""),
        (Form(channels=3, stacked=True), ""),
        (Form(stacked=True), ""),
        (Form(channels=3, stacked=True, channels_first=False), ""),
        (Form(element=Element.UINT8, channels=3), ""),
        (Form(element=Element.FLOAT16), ""),
        (Form(names=("right_image", "left_image")), ""),
        (Form(sign=-1), "?output=flow"),
        (Form(size=(64, 160)), ""),
        (Form(size=(60, 120)), ""),
        (Form(size=("rows", 128)), ""),
    ],
    ids=str,
)
def test_a_shift_is_found_by_networks_of_every_form(form: Form, options: str, tmp_path: Path) -> None:
    """Grey and colour, one input or two, channels first or last, any or a larger size: a shift of 7 px is disparity 7."""
    matcher = _matcher(block_network(tmp_path / "net.onnx", form), options)
    found = matcher.match(_colour(_pair()) if form.channels == 3 else _pair())
    assert found.dtype == np.float32
    assert found.shape == (60, 120)
    assert (found[4:-4, SHIFT_PX + 4 : -4] == SHIFT_PX).mean() > 0.95


def test_a_larger_image_is_reduced_and_its_disparity_enlarged(tmp_path: Path) -> None:
    """A network for 60 columns, fed with 120, finds half of 8 px and gives 8."""
    matcher = _matcher(block_network(tmp_path / "net.onnx", Form(size=(30, 60))))
    found = matcher.match(_pair(by_px=8, coarse_px=7))
    assert found.shape == (60, 120)
    inside = found[8:-8, 24:-12]
    assert (inside == 8).mean() > 0.9


def test_red_is_red(tmp_path: Path) -> None:
    """The first channel of a colour network is red: one whose other channels count for nothing would not see a blue pair."""
    graph = Graph()
    graph.inputs = [value_info(name, Element.FLOAT, (1, 3, "rows", "columns")) for name in ("left", "right")]
    ends = (graph.whole(0), graph.whole(1), graph.whole(1))
    reds = [graph.add("Slice", [name, *ends]) for name in ("left", "right")]
    graph.name("Add", reds, "disparity")
    graph.outputs = [value_info("disparity", Element.FLOAT, (1, 1, "rows", "columns"))]
    path = graph.write(tmp_path / "red.onnx")
    red = np.zeros((20, 40, 3), np.uint8)
    red[..., 2] = 3
    red[:, 30:, 0] = 200  # rows that change nowhere get no value
    found = _matcher(path, "?input=bytes&check=no").match(RectifiedPair(red, red))
    assert (found[:, 12:30] == 6).all()
    found = _matcher(path, "?input=bytes&check=no").match(RectifiedPair(red[..., ::-1], red[..., ::-1]))
    assert (found[:, 12:30] == 0).all()


def test_values_that_cannot_be_get_none(tmp_path: Path) -> None:
    """A network that says 9 everywhere: nothing left of column 9, nothing at all for N = 9, nothing where nothing changes."""
    graph = Graph()
    graph.inputs = [value_info(name, Element.FLOAT, (1, 1, "rows", "columns")) for name in ("left", "right")]
    nothing = graph.add("Mul", [graph.add("Add", ["left", "right"]), graph.number(0.0)])
    graph.name("Add", [nothing, graph.number(9.0)], "disparity")
    graph.outputs = [value_info("disparity", Element.FLOAT, (1, "rows", "columns"))]
    path = graph.write(tmp_path / "nine.onnx")
    pair = RectifiedPair(noise(40, 20, 1), noise(40, 20, 2))
    found = _matcher(path).match(pair)
    assert np.isnan(found[:, :9]).all()
    assert (found[:, 9:31] == 9).all()
    assert np.isnan(_matcher(path, disparities=9).match(pair)).all()
    plain = np.full((20, 40), 90, np.uint8)
    assert np.isnan(_matcher(path).match(RectifiedPair(plain, plain))).all()


def test_what_the_two_views_disagree_on_gets_no_value(tmp_path: Path) -> None:
    """For unrelated images the check drops more than half; without it a network answers everywhere."""
    path = block_network(tmp_path / "net.onnx", Form(disparities=40))
    pair = RectifiedPair(noise(160, 60, 1), noise(160, 60, 2))
    assert np.isfinite(_matcher(path, "?check=no", 40).match(pair)[:, 40:]).all()
    assert np.isnan(_matcher(path, "", 40).match(pair)).mean() > 0.5


@pytest.mark.parametrize("size", [(1, 1), (1, 50), (50, 1), (3, 5), (33, 65)])
def test_small_and_odd_sizes_work(size: tuple[int, int], tmp_path: Path) -> None:
    """Any size gives a map of its shape with values in [0, N)."""
    height, width = size
    found = _matcher(block_network(tmp_path / "net.onnx"), disparities=5).match(_pair(width, height, 2))
    assert found.shape == size
    values = found[~np.isnan(found)]
    assert ((values >= 0) & (values < 5)).all()


def test_the_file_is_read_anew_when_it_has_changed(tmp_path: Path) -> None:
    """A network that is replaced by another is not taken from memory."""
    path = block_network(tmp_path / "net.onnx")
    pair, other = _pair(90, 40, 3), Form(size=(30, 60))
    before = _matcher(path).match(pair)
    block_network(path, other)
    os.utime(path, ns=(1, 1))
    after = _matcher(path).match(pair)
    assert np.array_equal(after, _matcher(block_network(tmp_path / "other.onnx", other)).match(pair), equal_nan=True)
    assert not np.array_equal(after, before, equal_nan=True)


def test_names_are_read() -> None:
    """The options of a name, their defaults, and a name that is written back as it was typed."""
    plain = network_named("onnx:a b/net.onnx")
    assert plain == NetworkMatcher(value="onnx:a b/net.onnx", path="a b/net.onnx")
    full = network_named("onnx:n.onnx?input=bytes&output=flow&check=no")
    assert (full.path, full.levels, full.sign, full.check) == ("n.onnx", Levels.BYTES, Sign.FLOW, Check.NO)


@pytest.mark.parametrize(
    "name",
    [
        "onnx:",
        "onnx:?input=unit",
        "onnx:n?",
        "onnx:n?size=3",
        "onnx:n?input=12",
        "onnx:n?check=no&check=yes",
        "onnx:n?input=",
    ],
)
def test_wrong_names_are_refused_in_one_line(name: str) -> None:
    """Without a path, with an unknown option, an unknown value or an option given twice."""
    with pytest.raises(SettingsError) as caught:
        matcher_named(name)
    assert "\n" not in str(caught.value)


def _refusal(kind: type[TandemError], path: Path) -> str:
    with pytest.raises(kind) as caught:
        _matcher(path)
    said = str(caught.value)
    assert "\n" not in said
    assert len(said) < 400
    return said


def test_missing_files_and_folders_are_told(tmp_path: Path) -> None:
    """A file that is not there, and a folder, are named with what was expected."""
    assert "No such file" in _refusal(SettingsError, tmp_path / "none.onnx")
    assert "folder" in _refusal(SettingsError, tmp_path)


@pytest.mark.parametrize("content", [b"", b"no network", bytes(range(256)) * 40])
def test_what_is_no_network_is_told(content: bytes, tmp_path: Path) -> None:
    """Other bytes, or none, are no network."""
    path = tmp_path / "bad.onnx"
    path.write_bytes(content)
    assert "cannot be loaded" in _refusal(DataError, path) or "takes 0 inputs" in _refusal(DataError, path)


@pytest.mark.parametrize(
    ("axes", "count", "element", "said"),
    [
        ((1, 5, "r", "c"), 2, Element.FLOAT, "5 x any x any"),
        ((2, 3, "r", "c"), 2, Element.FLOAT, "2 x 3"),
        ((10,), 2, Element.FLOAT, "of 10"),
        ((1, 3, "r", "c"), 3, Element.FLOAT, "takes 3 inputs"),
        ((1, 3, "r", "c"), 1, Element.FLOAT, "3 x any"),
        ((1, 1, "r", "c"), 2, Element.INT64, "int64"),
    ],
)
def test_networks_of_another_kind_are_refused(
    axes: tuple[int | str, ...], count: int, element: Element, said: str, tmp_path: Path
) -> None:
    """Five channels, a batch of two, a vector, three inputs, one image only, whole numbers: the message names what it takes."""
    graph = Graph()
    graph.inputs = [value_info(f"i{number}", element, axes) for number in range(count)]
    graph.name("Identity", ["i0"], "out")
    graph.outputs = [value_info("out", element, axes)]
    assert said in _refusal(DataError, graph.write(tmp_path / "other.onnx"))


def test_a_map_of_another_size_is_refused(tmp_path: Path) -> None:
    """A network that gives half of the pixels is told with both sizes."""
    graph = Graph()
    graph.inputs = [value_info(name, Element.FLOAT, (1, 1, "rows", "columns")) for name in ("left", "right")]
    both = graph.add("Add", ["left", "right"])
    graph.name("AveragePool", [both], "disparity", kernel_shape=[2, 2], strides=[2, 2])
    graph.outputs = [value_info("disparity", Element.FLOAT, (1, 1, "r", "c"))]
    matcher = _matcher(graph.write(tmp_path / "half.onnx"))
    with pytest.raises(DataError, match="gave 1 x 1 x 32 x 64 values for images of 128x64"):
        matcher.match(_pair())


def test_a_network_that_gives_a_class_is_refused(tmp_path: Path) -> None:
    """A network that has no map among its outputs is refused when it is loaded."""
    graph = Graph()
    graph.inputs = [value_info(name, Element.FLOAT, (1, 1, 8, 8)) for name in ("left", "right")]
    graph.name("Concat", ["left", "right", "left", "right"], "classes", axis=1)
    graph.outputs = [value_info("classes", Element.FLOAT, (1, 4, 8, 8))]
    assert "gives classes" in _refusal(DataError, graph.write(tmp_path / "class.onnx"))


def test_without_onnxruntime_the_package_is_named(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the package is missing, one line says so and how it is had."""
    path = block_network(tmp_path / "net.onnx")
    monkeypatch.setitem(sys.modules, "onnxruntime", None)
    said = _refusal(UnavailableError, path)
    assert "onnxruntime" in said
    assert "pip install" in said
