"""The pose graph: loops that agree put pieces where they belong, an error is shared out, a wrong loop loses its say."""

import numpy as np
import pytest

from phone_host.geometry.se3 import SE3
from phone_host.scan.graph import Loop, connected, settled, without_outliers

TRUTH = {at: SE3.of(np.array([0.3 * at, -0.2 * at, 0.5 * at, 0.4 * at, 0.1 * at**2, -0.3 * at])) for at in range(5)}


def loop(here: int, there: int, off: SE3 | None = None) -> Loop:
    """What is true of two pieces, or that and an error."""
    true = TRUTH[here].inverse() @ TRUTH[there]
    return Loop(here=here, there=there, here_there=true if off is None else true @ off, turn=0.005, shift_m=0.01)


def off_m(found: dict[int, SE3], at: int) -> float:
    """How far a piece is from where it belongs."""
    return float(np.linalg.norm((TRUTH[at].inverse() @ found[at]).t_m))


def test_true_loops_put_every_piece_where_it_belongs() -> None:
    """From a start 0.2 m and 0.1 rad away, to a micrometre."""
    random = np.random.default_rng(4)
    start = {at: pose @ SE3.of(random.normal(0, 0.05, 6)) if at else pose for at, pose in TRUTH.items()}
    found = settled(start, [loop(0, 1), loop(2, 1), loop(2, 3), loop(3, 4), loop(4, 0)], 0)
    assert max(off_m(found, at) for at in TRUTH) < 1e-6
    assert np.array_equal(found[0].t_m, TRUTH[0].t_m)


def test_an_error_is_shared_out_over_the_loops() -> None:
    """Three equal loops around a triangle that miss each other by 6 mm: each takes a third, so no piece moves farther than 4 mm."""
    along = SE3(np.eye(3), np.array([0.006, 0.0, 0.0]))
    still = {at: SE3.identity() for at in range(3)}
    loops = [
        Loop(here=one, there=other, here_there=along if other == 0 else SE3.identity(), turn=0.005, shift_m=0.01)
        for one, other in ((0, 1), (1, 2), (2, 0))
    ]
    found = settled(still, loops, 0)
    assert found[1].t_m[0] == pytest.approx(-0.002, abs=5e-5)
    assert found[2].t_m[0] == pytest.approx(-0.004, abs=5e-5)


def test_a_wrong_loop_loses_its_say() -> None:
    """One of five loops to a piece is 0.5 m off: it moves the piece by less than a millimetre."""
    wrong = SE3.of(np.array([0.0, 0.4, 0.0, 0.5, 0.0, 0.0]))
    found = settled(dict(TRUTH), [*[loop(0, 1)] * 4, loop(0, 1, wrong)], 0)
    assert off_m(found, 1) < 1e-3


def test_pieces_without_loops_stay() -> None:
    """What no loop connects with the piece that stands still is where it was."""
    start = {**TRUTH, 4: SE3.identity()}
    loops = [loop(0, 1), loop(2, 3)]
    found = settled(start, loops, 0)
    assert connected(loops, 0) == {0, 1}
    assert found[4] is start[4]
    assert found[3] is start[3]
    assert settled(start, [], 0) == start


def shifted(x_m: float) -> SE3:
    """Somewhere along a straight way."""
    return SE3(np.eye(3), np.array([x_m, 0.0, 0.0]))


def tracked(here: int) -> Loop:
    """What tracking says of two parts 1 m apart."""
    step = shifted(1.0)
    return Loop(here=here, there=here + 1, here_there=step, turn=0.02, shift_m=0.06, is_tracked=True)


def recognised(here: int, there: int, x_m: float) -> Loop:
    """What a view that was recognised says of two parts."""
    return Loop(here=here, there=there, here_there=shifted(x_m), turn=0.006, shift_m=0.01)


def test_ties_do_not_shield_a_wrong_loop() -> None:
    """Two loops side by side that agree are 0.5 m off, and the ties take that up; three true ones contradict them: the two are gone, the three stay."""
    believed, ties = {at: shifted(float(at)) for at in range(9)}, [tracked(at) for at in range(8)]
    right, wrong = (
        [recognised(0, 6, 6.02), recognised(0, 7, 7.02), recognised(1, 8, 7.01)],
        [recognised(0, 3, 3.5), recognised(0, 4, 4.5)],
    )
    found = without_outliers(believed, [*ties, *wrong, *right], 0, 4.0)
    assert found.loops == (*ties, *right)
    assert all(abs(found.poses[at].t_m[0] - at) < 0.03 for at in range(9))


def test_drift_that_true_loops_take_out_makes_none_of_them_wrong() -> None:
    """Tracking has lost 3 % of the way: loops that say so all stay, as does one that alone connects two parts."""
    believed, ties = {at: shifted(float(at)) for at in range(10)}, [tracked(at) for at in range(8)]
    loops = [recognised(0, 6, 6.18), recognised(0, 7, 7.2), recognised(1, 8, 7.22), recognised(4, 9, 7.0)]
    assert without_outliers(believed, [*ties, *loops], 0, 4.0).loops == (*ties, *loops)
