"""The commands that the page of `stereo` offers: the remedy's where there is one, and none that repeats a mistake."""

import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from phone_host.diagnostics.arrangement import FILE_REMEDIES
from phone_host.diagnostics.codes import Code, diagnose
from phone_host.diagnostics.headline import Answer, Grade
from phone_host.diagnostics.image_rules import ImageFigures
from phone_host.model import Arrangement
from phone_host.output.axes import Axes
from phone_host.output.pair_files import WrittenPair
from phone_host.report.stereo_next import Typed, next_commands
from phone_host.report.stereo_report import PairReport
from phone_host.report.stereo_trust import PairTrust

_TYPED = Typed(
    words=("stereo", "im L.png", "r.png", "--rectified", "--out", "scan"),
    images=("im L.png", "r.png"),
    axes=Axes.CAMERA,
    rig="",
    folder=Path("/home/me/my photos"),
)
_PAIR = PairReport(
    name="",
    left="im L.png",
    right="r.png",
    left_px=(40, 25),
    right_px=(40, 25),
    rectified_px=(40, 25),
    matcher="sgbm",
    search=None,
    geometry=None,
    limits=None,
    cut=None,
    density=0.8,
    axes=Axes.CAMERA,
    written=WrittenPair(files=("cloud.ply",), points=700),
    stages_ms=(("total", 1.0),),
    trust=PairTrust(ImageFigures(), (), Answer(Grade.GOOD, "Right.")),
)


def _wrong(remedy: str) -> PairReport:
    concern = diagnose(Code.SWAPPED, "something is wrong", remedy)
    return replace(_PAIR, trust=PairTrust(ImageFigures(), (concern,), Answer(Grade.BAD, "Wrong.")))


def _words(typed: Typed, *pairs: PairReport) -> list[list[str]]:
    """The commands behind `cd FOLDER && phone-host`, as a shell reads them."""
    found = [shlex.split(one.command) for one in next_commands(typed, pairs)]
    assert all(words[:3] == ["cd", "/home/me/my photos", "&&"] for words in found)
    return [words[4:] for words in found]


def test_a_cloud_is_offered_with_y_up_in_the_folder_where_the_paths_hold() -> None:
    """The same words with --axes y-up; with a rig, also a live run; without a cloud or with y up already, nothing."""
    assert _words(_TYPED, _PAIR) == [[*_TYPED.words, "--axes", "y-up"]]
    assert [words[0] for words in _words(replace(_TYPED, rig="rig.yaml"), _PAIR)] == ["stereo", "run"]
    assert _words(_TYPED, replace(_PAIR, written=WrittenPair(files=()))) == []
    assert _words(replace(_TYPED, axes=Axes.Y_UP), _PAIR) == []


def test_exchanged_images_are_offered_the_other_way_round_and_nothing_else() -> None:
    """Not the wrong command again with y up, nor a run with a rig; three words for two sides cannot be exchanged."""
    swapped = _wrong(FILE_REMEDIES[Arrangement.SWAPPED].words)
    right = ["stereo", "r.png", "im L.png", "--rectified", "--out", "scan"]
    assert _words(replace(_TYPED, rig="rig.yaml"), swapped) == [right]
    assert _words(_TYPED, swapped, swapped) == [right]
    assert _words(replace(_TYPED, images=("im L.png", "r.png", "s.png")), swapped) == []
    assert _words(replace(_TYPED, words=()), swapped) == []


@pytest.mark.parametrize("arrangement", [one for one in FILE_REMEDIES if one is not Arrangement.SWAPPED])
def test_turned_and_mirrored_images_are_offered_each_try_of_the_remedy(arrangement: Arrangement) -> None:
    """The same command with the options that the remedy names, one command for each possibility."""
    remedy = FILE_REMEDIES[arrangement]
    assert _words(_TYPED, _wrong(remedy.words)) == [[*_TYPED.words, *given] for given in remedy.tries]


def test_an_option_that_is_there_already_is_not_given_twice() -> None:
    """Whoever has turned the left image is only offered to turn the right one."""
    typed = replace(_TYPED, words=(*_TYPED.words, "--rotate-left", "90"))
    [only] = _words(typed, _wrong(FILE_REMEDIES[Arrangement.TURNED].words))
    assert only[-2:] == ["--rotate-right", "180"]


def test_any_other_wrong_result_offers_nothing_and_one_good_pair_is_enough_for_y_up() -> None:
    """A covered lens has no command; of several pairs, those that are right are worth turning."""
    assert _words(_TYPED, _wrong("take off the lens cap")) == []
    assert _words(_TYPED, _wrong("take off the lens cap"), _wrong("x")) == []
    assert len(_words(_TYPED, _wrong("take off the lens cap"), _PAIR)) == 1
