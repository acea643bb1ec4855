"""The matcher's entry in the library: any pair gives the same bits on all instruction sets and threads, and nothing else is touched.

With sanitizers in `test_sanitized`; for longer, `python -m tests.native.fuzz_match` (`make fuzz`).
"""

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from phone_host.model import RectifiedPair
from phone_host.native.library import Library, MatchJob, Simd
from phone_host.stereo.match_tandem import TandemMatcher
from tests.native.match_cases import MatchCase, fixed_cases, random_case, result_of, tiles
from tests.support.planes import noise

CASES = 12
"""Random pairs for each instruction set: few, because sanitizers make them slow; fuzz_match tries more."""


Result = tuple[NDArray[np.float32], NDArray[np.uint8]]


def reference(library: Library, case: MatchCase) -> Result:
    """What a case must give: the bits of plain C with one thread."""
    return result_of(library.using(Simd.SCALAR), replace(case, threads=1))


def require_sound(library: Library, case: MatchCase, expected: Result | None = None) -> None:
    """Check a result: the bits of the reference, values only in [0, N), confidence just where there is a value."""
    disparity, confidence = result_of(library, case)
    expected = reference(library, case) if expected is None else expected
    assert (disparity.tobytes(), confidence.tobytes()) == tuple(array.tobytes() for array in expected), case
    values = disparity[~np.isnan(disparity)]
    assert ((values >= 0) & (values < case.disparities)).all(), case
    assert ((confidence > 0) == ~np.isnan(disparity)).all(), case


@pytest.fixture(scope="module")
def fixed(native_library: Library) -> list[tuple[MatchCase, Result]]:
    """The fixed cases and what they must give; once for all instruction sets, as plain C is slow with sanitizers."""
    return [(case, reference(native_library, case)) for case in fixed_cases()]


def test_fixed_cases(library: Library, fixed: list[tuple[MatchCase, Result]]) -> None:
    """Every kind of content, and sizes around those of registers, strips and tiles, with and without the guide."""
    for case, expected in fixed:
        require_sound(library, case, expected)


def test_random_cases(library: Library) -> None:
    """Pairs of up to 70 x 70 px and 80 disparities, with padded and turned rows, on any number of threads."""
    random = np.random.default_rng(2)
    for _ in range(CASES):
        require_sound(library, random_case(random))


def test_the_guide_changes_a_case_that_the_others_are_compared_with(native_library: Library) -> None:
    """Tiles before a bare wall: with the guide other pixels have values, so comparing its bits compares its work."""
    case = tiles(np.random.default_rng(20))
    (plain, _), (guided, _) = (result_of(native_library, replace(case, guide=guide)) for guide in (False, True))
    assert (np.isnan(plain) != np.isnan(guided)).mean() > 0.05


def test_what_the_library_cannot_hold_is_refused(library: Library) -> None:
    """Sizes below 1 or too large, too many disparities and too small a workspace are answered with an error, before anything is read."""
    usual = {"width": 8, "height": 8, "disparities": 4, "threads": 1}
    for wrong in (
        {"width": 0},
        {"height": 0},
        {"width": -5},
        {"width": 32768},
        {"disparities": 0},
        {"disparities": 2049},
    ):
        job = MatchJob(**{**usual, **wrong})
        assert library.handle.tandem_match(library.isa, job) == 2
    job = MatchJob(**usual)
    job.workspace_bytes = library.match_bytes(job) - 1
    assert library.handle.tandem_match(library.isa, job) == 3
    assert library.handle.tandem_match(99, job) == 1


@pytest.mark.parametrize(
    "size", [(0, 9, 4), (9, -8, 4), (9, 9, 0), (9, 9, -3), (40_000, 9, 4), (9, 40_000, 4), (9, 9, 4000)]
)
def test_sizes_that_nobody_can_match_have_no_workspace(native_library: Library, size: tuple[int, int, int]) -> None:
    """The library itself refuses such sizes, whoever calls it."""
    width, height, disparities = size
    assert native_library.match_bytes(MatchJob(width=width, height=height, disparities=disparities, threads=1)) == -1


def test_no_value_points_out_of_the_right_image(native_library: Library) -> None:
    """Neither the average nor the guide leads beyond the first column: the partner of x is at x - d > -1."""
    for seed in range(300):
        left, right = (noise(6, 20, seed=2 * seed + side) for side in (0, 1))
        found = TandemMatcher(14, native_library, 1).match(RectifiedPair(left, right))
        assert (np.nan_to_num(found) < np.arange(6) + 1).all(), seed
