"""The part of YAML in which calibrations are written: values as the format defines them, one line of error for anything else."""

import subprocess
import sys
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import DataError
from phone_host.output.rig_files.tree import Tree, read_xml
from phone_host.output.rig_files.yaml_text import read_yaml


@pytest.mark.parametrize(
    ("text", "tree"),
    [
        ("a: 1\nb: two words # a comment\n", {"a": "1", "b": "two words"}),
        ("%YAML:1.0\n---\na: 1\n...\n", {"a": "1"}),
        ("a:\n  b: 1\n  c:\n    d: 2\ne: 3", {"a": {"b": "1", "c": {"d": "2"}}, "e": "3"}),
        ("a:\n- 1\n- 2\nb: 3", {"a": ["1", "2"], "b": "3"}),
        ("a:\n  - [1, 2]\n  - [3, 4]", {"a": [["1", "2"], ["3", "4"]]}),
        ("a: [1,\n    2,  # why\n  3]\nb: 4", {"a": ["1", "2", "3"], "b": "4"}),
        ("a: {b: 1, c: [2]}", {"a": {"b": "1", "c": ["2"]}}),
        ("- x: 1\n  y: 2\n- x: 3", [{"x": "1", "y": "2"}, {"x": "3"}]),
        ("M: !!opencv-matrix\n   rows: 1\n   data: [ 1., 2. ]", {"M": {"rows": "1", "data": ["1.", "2."]}}),
        ("a: 'it: # is'\nb: \"x\"", {"a": "it: # is", "b": "x"}),
        ("a:\nb: 1", {"a": "", "b": "1"}),
        ("\ufeffa: []", {"a": []}),
        ("""a: ["x, y", '[z]', w]""", {"a": ["x, y", "[z]", "w"]}),
        ('%YAML:1.0\na:[ 1, 2 ]\nb:"x"\nc: { x:1, y:"q" }', {"a": ["1", "2"], "b": "x", "c": {"x": "1", "y": "q"}}),
        ("a: [010, 1:30, 1_0, 0x10, yes, ~, 1e3]", {"a": ["010", "1:30", "1_0", "0x10", "yes", "~", "1e3"]}),
        ("header: {stamp: 1}\na: 1\n---\nheader: {stamp: 2}\na: 1\n---\n", {"header": {"stamp": "1"}, "a": "1"}),
        ("a: |\n  two\n  lines\n", {"a": "two\nlines\n"}),
        ("""a: {"b:c": 'd}', 'e': "f"}""", {"a": {"b:c": "d}", "e": "f"}}),
    ],
)
def test_values_are_those_that_the_format_defines(text: str, tree: Tree) -> None:
    """Maps, lists, brackets over several lines, tags, quotes and comments, as YAML 1.1 has them."""
    assert read_yaml(text, "f") == tree


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "holds nothing"),
        ("%YAML:1.0\n---\n...\n", "holds nothing"),
        ("a: [1, 2", "is no YAML"),
        ("a: 1]\nb: }", "line 2 is no YAML"),
        ("a: 1\na: 2", "line 2 has the key a a second time"),
        ("a: {b: 1, b: 2}", "line 1 has the key b a second time"),
        ("a: &x 1", "line 1 has an anchor"),
        ("a: 1\nb: *x", "line 2 has an alias"),
        ("a: &x {b: 1}", "line 1 has an anchor"),
        ("a: &x [1]", "line 1 has an anchor"),
        ("? [1, 2]\n: 3", "line 1 has a key that is no word"),
        ("a: 1\n---\nb: 2", "line 2 begins a second document, which differs"),
        ("a:\n\tb: 1", "line 2 is no YAML"),
        ("a: 'x", "is no YAML"),
        ("a: [1,\t'x]", "is no YAML"),
        ("a: 1\n   b: 2", "line 2 is no YAML"),
        ("a: 1\nword", "is no YAML"),
        ("a: ['x' y]", "line 1 is no YAML"),
        ("a: [1] 2", "line 1 is no YAML"),
        ("a: \x01", "is no YAML: it holds a control character"),
        ("a: " + "[" * 60 + "]" * 60, "line 1 lies more than 32 levels deep"),
        ("".join(" " * level + "a:\n" for level in range(60)), "levels deep"),
    ],
)
def test_what_is_not_read_is_refused_with_its_line(text: str, said: str) -> None:
    """Anchors, several documents, broken brackets and the like end in one line that names file and line."""
    with pytest.raises(DataError) as caught:
        read_yaml(text, "rig.yml")
    assert said in caught.value.problem
    assert caught.value.problem.startswith("rig.yml")


@given(st.text(alphabet="ab:-[]{},#'\" \n\t&1.", max_size=60))
def test_any_text_is_read_or_refused(text: str) -> None:
    """Whatever stands in the file, there is a value or a DataError, never another exception."""
    with suppress(DataError):
        assert isinstance(read_yaml(text, "f"), str | list | dict)


_WORDS = st.text(alphabet="abcxyz019.", min_size=1, max_size=6)
_TREES = st.recursive(
    _WORDS, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text("abc", min_size=1), inner, max_size=4)
)


def _flow(tree: Tree) -> str:
    if isinstance(tree, list):
        return f"[{', '.join(map(_flow, tree))}]"
    if isinstance(tree, dict):
        return "{" + ", ".join(f"{key}: {_flow(value)}" for key, value in tree.items()) + "}"
    return tree


@given(st.dictionaries(st.text("abc", min_size=1), _TREES, min_size=1, max_size=4))
def test_what_is_written_in_brackets_is_read_back(tree: dict[str, Tree]) -> None:
    """Nested lists and maps on one line each give the same values."""
    assert read_yaml("\n".join(f"{key}: {_flow(value)}" for key, value in tree.items()), "f") == tree


_WITHOUT = """
import sys
sys.modules["yaml"] = None  # as where it is not installed
import phone_host.doctor.vision_checks, phone_host.verbs.doctor, phone_host.verbs.run
from phone_host.output.rig_files.yaml_text import read_yaml
try:
    read_yaml("a: 1", "f")
except Exception as error:
    print(type(error).__name__, error)
"""


def test_a_host_without_pyyaml_runs_and_names_it_where_it_is_needed() -> None:
    """`run` and `doctor` load without it; a calibration of another program says in one line what to install."""
    done = subprocess.run([sys.executable, "-c", _WITHOUT], capture_output=True, text=True, check=False, timeout=120)
    assert done.stdout.strip() == (
        "UnavailableError YAML of other programs needs PyYAML: pip install PyYAML, or apt install python3-yaml"
    )
    assert done.stderr == ""


def test_xml_of_filestorage_gives_the_same_values() -> None:
    """A matrix is a map of rows, cols and data, a list has elements called _."""
    text = (
        '<?xml version="1.0"?><opencv_storage><w>640</w><s>640 480</s><l><_>1</_><_>2</_></l>'
        '<M type_id="opencv-matrix"><rows>1</rows><cols>2</cols><dt>d</dt><data>\n 1. 2.</data></M></opencv_storage>'
    )
    matrix: dict[str, Tree] = {"rows": "1", "cols": "2", "dt": "d", "data": "1. 2."}
    assert read_xml(text, "f") == {"w": "640", "s": "640 480", "l": ["1", "2"], "M": matrix}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<a><b></a>", "is no XML"),
        ("<a><b>1</b><b>2</b></a>", "the key b twice"),
        ('<!DOCTYPE a [<!ENTITY b "c">]><a>&b;</a>', "declares a document type"),
        ("<a>" * 50 + "</a>" * 50, "levels deep"),
    ],
)
def test_other_xml_is_refused(text: str, said: str) -> None:
    """Broken XML, keys that are there twice and entities are told in one line."""
    with pytest.raises(DataError, match=said):
        read_xml(text, "f")
