"""What bench_matcher and its parts make of figures that are known."""

from pathlib import Path

import pytest

from phone_host.native.build_library import SOURCES
from tests.bench.bench_matcher import OLD, Row, with_old_sgbm
from tests.bench.depth_variants import VariantError, current, variants_of, with_values
from tests.bench.match_contestants import Times
from tests.bench.match_instructions import Counts, Pair


def test_the_old_sgbm_stands_at_its_multiple_of_the_bare_pass() -> None:
    """Its wall clock is 4.6 times 3WAY's of the same run; ours at a fifth of that reaches the factor, a little slower does not."""
    theirs = with_old_sgbm({"tandem": Times(1, 1), "3WAY": Times(10, 20)})[OLD]
    assert (theirs.wall_ms, theirs.cpu_ms) == pytest.approx((46, 76))
    for ours_ms, reached in ((9.1, True), (9.3, False)):
        verdict = Row("match", "640x480", 640, OLD, Times(ours_ms, 20), theirs, 0, 0).verdict
        assert verdict is not None
        assert verdict.reached is reached


def test_todays_sgbm_is_no_figure() -> None:
    """It stands beside for information."""
    assert Row("match", "640x480", 640, "sgbm", Times(9, 9), Times(10, 10), 0, 0).verdict is None


def test_neon_may_take_half_as_many_instructions_more() -> None:
    """A ratio of 1.5 is reached, 1.6 is not, and where one of both was not counted the reason is told."""
    pair = Pair()
    assert [verdict.reached for verdict in Counts(pair, {"NEON": 3.0, "SSE4.1": 2.0}, {}).verdicts()] == [True]
    assert [verdict.reached for verdict in Counts(pair, {"NEON": 3.2, "SSE4.1": 2.0}, {}).verdicts()] == [False]
    half = Counts(pair, {"SSE4.1": 2.0}, {"NEON": "aarch64-linux-gnu-gcc"})
    assert half.verdicts() == []
    assert "NEON: not counted: aarch64-linux-gnu-gcc is not installed" in str(half)


def test_variants_change_one_value_each_and_the_product_nothing(tmp_path: Path) -> None:
    """A copy of the sources has the new value, the product's sources the old one; the copy's digest is another one."""
    before = current("STEP_COST")
    module = with_values({"STEP_COST": before + 2}, tmp_path / "copy")
    assert current("STEP_COST", tmp_path / "copy" / "src") == before + 2
    assert current("JUMP_COST", tmp_path / "copy" / "src") == current("JUMP_COST")
    assert current("STEP_COST") == before
    same = with_values({"STEP_COST": before}, tmp_path / "same")
    assert module.sources_digest() != same.sources_digest()
    assert {path.name for path in SOURCES.glob("*.[ch]")} == {
        path.name for path in (tmp_path / "same" / "src").iterdir()
    }


def test_a_constant_is_one_number_in_one_place(tmp_path: Path) -> None:
    """A product of numbers, and one that two files set, cannot be varied."""
    (tmp_path / "one.h").write_text("enum { SIZE = 6 * 1024, /* bytes */ EDGE = 3 };\n", encoding="ascii")
    assert current("EDGE", tmp_path) == 3
    with pytest.raises(VariantError, match=r"SIZE is 6 \* 1024, which is no plain number"):
        current("SIZE", tmp_path)
    (tmp_path / "two.c").write_text("enum { EDGE = 4 };\n", encoding="ascii")
    with pytest.raises(VariantError, match="EDGE is set in 2 places"):
        current("EDGE", tmp_path)


def test_variants_are_one_at_a_time_or_all_combinations() -> None:
    """Three values of two constants, each with the present one: four variants and the present, or eight and the present."""
    step, jump = current("STEP_COST"), current("JUMP_COST")
    choices = {"STEP_COST": (step - 1, step, step + 1), "JUMP_COST": (jump - 1, jump, jump + 1)}
    assert len(variants_of(choices, grid=False)) == 5
    assert len(variants_of(choices, grid=True)) == 9
    with pytest.raises(VariantError, match="NOTHING is set in 0 places"):
        variants_of({"NOTHING": (1,)}, grid=False)
