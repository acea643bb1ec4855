"""Values of a calibration file: what has the right shape is read in each way that programs write it, anything else is refused by file and key."""

import numpy as np
import pytest

from common.errors import DataError
from phone_host.output.rig_files.tree import Node, Tree

MATRIX = np.arange(6.0).reshape(2, 3)


def node(tree: Tree) -> Node:
    """A value under the key `k`."""
    return Node("rig.yaml", "k", tree)


@pytest.mark.parametrize(
    "tree",
    [
        ["0", "1", "2", "3", "4", "5"],
        "0 1 2 3 4 5",
        [["0", "1", "2"], ["3", "4", "5"]],
        [["0", "1", "2"], "3 4 5"],
        {"rows": "2", "cols": "3", "data": ["0", "1", "2", "3", "4", "5"]},
        {"rows": "2", "cols": "3", "data": "0 1 2 3 4 5"},
    ],
)
def test_a_matrix_is_read_in_each_way_of_writing_it(tree: Tree) -> None:
    """One list, rows, numbers with blanks between them, or OpenCV's map."""
    assert np.array_equal(node(tree).matrix(2, 3), MATRIX)


@pytest.mark.parametrize(
    ("tree", "words"),
    [
        ({"rows": "3", "cols": "2", "data": []}, "is 3x2"),
        ({"rows": "2", "cols": "3"}, "k.data is missing"),
        ({"rows": "2", "cols": "1.5", "data": []}, "k.cols holds 1.5"),
        ([["0", "1", "2"]], "has 1 rows"),
        ([["0", "1"], ["3", "4"]], "has 2 values"),
        ([["0", "1", "2"], ["3", ["4"], "5"]], "is no list of numbers"),
        ({"data": "1"}, "k.rows is missing"),
        ("0 1 2 3 4 nan", "holds 'nan'"),
        ("0 1 2 3 4 1e10", "holds '1e10'"),
        ("0 1 2 3 4 " + "9" * 60, "holds '99"),
    ],
)
def test_what_is_no_such_matrix_is_refused(tree: Tree, words: str) -> None:
    """One line names file, key and what stands there, of a long word its beginning."""
    with pytest.raises(DataError) as refused:
        node(tree).matrix(2, 3)
    assert words in refused.value.problem
    assert refused.value.problem.startswith("rig.yaml: k")
    assert len(refused.value.problem) < 80


@pytest.mark.parametrize(
    "tree",
    ["1 2 3", ["1", "2", "3"], [["1", "2", "3"]], [["1"], ["2"], ["3"]], {"rows": "1", "cols": "3", "data": "1 2 3"}],
)
def test_a_list_of_any_length_may_be_a_row_or_a_column(tree: Tree) -> None:
    """As numpy's `tolist` and OpenCV write distortion."""
    assert node(tree).values() == (1.0, 2.0, 3.0)


def test_an_empty_list_holds_nothing_and_two_columns_are_no_list() -> None:
    """No distortion is a list without numbers; a table is none."""
    assert node([]).values() == ()
    with pytest.raises(DataError, match="has 2 values"):
        node([["1", "2"], ["3", "4"]]).values()


def test_words_are_words_and_sizes_whole_numbers() -> None:
    """A list is no word, a map no list, and no image has half a pixel, none, or a kilometre of them."""
    assert node("abc").word() == "abc"
    assert node("640 480").size_px() == (640, 480)
    no_words: tuple[Tree, ...] = (["a"], {"a": "b"})
    for tree in no_words:
        with pytest.raises(DataError, match="is no word"):
            node(tree).word()
    with pytest.raises(DataError, match="is no list of numbers"):
        node({"a": "b"}).numbers()
    for text in ("640 0", "640 -480", "640.5 480", "640 1000000"):
        with pytest.raises(DataError, match="must be a whole number above 0"):
            node(text).size_px()


def test_the_first_name_that_is_there_is_taken_and_else_the_first_is_missed() -> None:
    """Programs name one thing in several ways; an error of the whole file names no key. A word holds no keys."""
    whole = Node("rig.yaml", "", {"K": "1", "camera_matrix": "", "D": []})
    assert whole.first_of("camera_matrix", "K").number() == 1.0
    assert whole.has("D")
    with pytest.raises(DataError, match=r"rig.yaml: P is missing"):
        whole.first_of("P", "Q")
    with pytest.raises(DataError, match=r"rig.yaml is no word"):
        whole.word()
    with pytest.raises(DataError, match=r"k.rows is missing"):
        node("abc").child("rows")
