"""When a browser's images were exposed: its clock, what its stamps count from, and which of them are believed."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from common.camera_identity import CameraIdentity
from common.frame import FrameFault
from phone_host.camera.browser_border import Believed, BrowserBorder, Disbelieved, Intervals
from phone_host.camera.browser_clock import BrowserClock, Epoch
from phone_host.camera.browser_wire import EchoAsked, EchoHeard, Hello
from phone_host.sync.clock import Heard
from tests.support.scripted_browser import LUMA, Shot

MS, S = 1_000_000, 1_000_000_000
PERIOD = 33_333_333
ORIGIN = 1_700_000_000 * S
"""Browser's clock minus host's clock."""
ASLEEP = 3600 * S
HELLO = Hello(
    identity=CameraIdentity("browser", "cam", "id"), track="t", software="", is_phone=False, resolution_ns=20_000
)
SHOT = Shot(payload=bytes(4), width=2, height=2, encoding=LUMA)
START = 1000 * S


def echo(clock: BrowserClock, number: int, host_ns: int, ways_ns: tuple[int, int], offset_ns: int = ORIGIN) -> Heard:
    """One echo that takes so long there and back; the browser's stamps are blurred to 5 us."""

    def blurred(ns: int) -> float:
        return (ns + offset_ns) // 5000 * 5.0

    asked = EchoAsked(number, blurred(host_ns))
    there_ns, back_ns = ways_ns
    t1_ns = host_ns + there_ns
    clock.asked(asked, t1_ns, t1_ns + 50_000)
    return clock.heard(EchoHeard(number, asked.t0_us, blurred(t1_ns + 50_000 + back_ns)))


def known_clock(seed: int = 1, offset_ns: int = ORIGIN) -> BrowserClock:
    """A browser's clock after five seconds of echoes over a busy loopback."""
    clock, random = BrowserClock(20_000), np.random.default_rng(seed)
    for number in range(40):
        there, back = (round(300_000 + random.exponential(500_000)) for _ in range(2))
        echo(clock, number, START + number * 100 * MS - 5 * S, (there, back), offset_ns)
    return clock


@pytest.mark.parametrize("seed", range(5))
def test_a_browsers_time_is_converted_within_its_uncertainty(seed: int) -> None:
    """Over a busy loopback the error is far below a millisecond and inside both the uncertainty and the bound."""
    found = known_clock(seed).to_host(ORIGIN + START)
    assert found is not None
    assert abs(found.ns - START) <= found.uncertainty_ns <= found.bound_ns < MS


def test_before_the_first_echo_no_time_is_known() -> None:
    """Nor does an echo teach anything that was never asked, or whose first stamp has changed since."""
    clock = BrowserClock(20_000)
    assert clock.to_host(ORIGIN) is None
    assert clock.round_trip_ns == 0
    assert clock.heard(EchoHeard(1, 1.0, 2.0)) is Heard.NOTHING
    clock.asked(EchoAsked(1, 1.0), 5, 6)
    assert clock.heard(EchoHeard(1, 1.5, 2.0)) is Heard.NOTHING
    for number in range(2, 40):
        clock.asked(EchoAsked(number, 1.0), 5, 6)
    assert clock.heard(EchoHeard(2, 1.0, 2.0)) is Heard.NOTHING  # long forgotten


def test_a_browser_whose_clock_steps_is_doubted_then_followed() -> None:
    """Echoes that contradict the earlier ones leave no time at all until they agree among themselves."""
    clock = known_clock()
    step = 10 * S
    heard = [echo(clock, 100 + n, START + n * 100 * MS, (300_000, 300_000), ORIGIN + step) for n in range(4)]
    assert heard[0] is Heard.DOUBTED
    assert Heard.STEPPED in heard
    found = clock.to_host(ORIGIN + step + START)
    assert found is not None
    assert abs(found.ns - START) <= found.bound_ns


class Film:
    """A camera behind a border: images on an even grid, handed over a little later.

    Args:
        stamp: a moment of the host's clock as the browser stamps it, ns.
    """

    def __init__(self, stamp: Callable[[int], int], *, near: bool = True, hello: Hello = HELLO) -> None:
        self.border, self.clock, self.stamp = BrowserBorder(None), known_clock(), stamp
        self.border.begin(hello, is_same_machine=near)
        self.random = np.random.default_rng(3)
        self.number, self.dropped = 0, 0

    def show(
        self, images: int = 1, shot: Shot = SHOT, late_ns: int = 0, *, capture: bool = False
    ) -> list[tuple[int, Believed | Disbelieved]]:
        """Show images; return when each was truly exposed, and what the border says of it."""
        shown = []
        for _ in range(images):
            exposed_ns = START + self.number * PERIOD
            callback_ns = exposed_ns + 2 * MS + round(self.random.exponential(MS))
            seen = replace(
                shot,
                stamp_us=self.stamp(exposed_ns + late_ns) / 1000,
                callback_us=(callback_ns + ORIGIN) / 1000,
                capture_us=(exposed_ns + 100_000 + ORIGIN) / 1000 if capture else float("nan"),
            )
            data = seen.packed(self.number, self.dropped, seen.callback_us + 1000)
            shown.append((exposed_ns, self.border.judge(data, callback_ns + 5 * MS, self.clock, ASLEEP)))
            self.number += 1
        return shown


def errors(shown: list[tuple[int, Believed | Disbelieved]]) -> list[int]:
    """How far the believed images' times are off, ns; each is inside its bound."""
    found = []
    for exposed_ns, judged in shown:
        assert isinstance(judged, Believed), judged
        found.append(judged.exposed.ns - exposed_ns)
    return found


@pytest.mark.parametrize(
    ("stamp", "epoch"),
    [
        (lambda ns: ns, Epoch.MONOTONIC),
        (lambda ns: ns + ASLEEP, Epoch.BOOTTIME),
        (lambda ns: ns + ORIGIN, Epoch.BROWSER),
        (lambda ns: ns - START, Epoch.FREE),
    ],
)
def test_the_epoch_of_stamps_is_found_out(stamp: Callable[[int], int], epoch: Epoch) -> None:
    """Whatever the stamps count from, it is known after six images, and the times are right; a free epoch errs by the fastest way."""
    film = Film(stamp)
    before = film.show(5)
    assert [judged for _, judged in before] == [Disbelieved(FrameFault.CLOCK_UNKNOWN)] * 5
    shown = film.show(60)
    assert film.border.epoch is epoch
    most_ns = 3 * MS if epoch is Epoch.FREE else MS
    assert all(-1000 <= error <= most_ns for error in errors(shown[10:])), errors(shown)
    assert (film.border.scatter_ns > 0) is (epoch is Epoch.FREE)


def test_a_clock_that_slept_is_told_from_one_that_runs_on() -> None:
    """If the machine slept for half a second, both clocks fit; the images are youngest on the right one."""
    film = Film(lambda ns: ns)
    film.show(6)
    assert film.border.epoch is Epoch.MONOTONIC
    border = BrowserBorder(None)
    border.begin(HELLO, is_same_machine=True)
    half = S // 2
    for number in range(6):
        exposed_ns = START + number * PERIOD
        shot = replace(SHOT, stamp_us=(exposed_ns + half) / 1000, callback_us=(exposed_ns + 3 * MS + ORIGIN) / 1000)
        border.judge(shot.packed(number, 0, shot.callback_us), exposed_ns + 9 * MS, film.clock, half)
    assert border.epoch is Epoch.BOOTTIME


def test_far_away_this_machines_clocks_are_not_believed() -> None:
    """Stamps of another machine that happen to look like this machine's clock have a free epoch."""
    film = Film(lambda ns: ns, near=False)
    film.show(6)
    assert film.border.epoch is Epoch.FREE


def test_a_stated_capture_time_is_nearer_than_the_hand_over() -> None:
    """With a free epoch the fastest image counts; one whose capture is stated is faster."""
    film = Film(lambda ns: ns - START)
    shown = film.show(40, capture=True)[6:]
    assert max(abs(error) for error in errors(shown)) < 300_000


def test_an_epoch_that_changes_is_found_out_anew() -> None:
    """Images that do not fit are dropped by name; four in a row, and the epoch is found out again."""
    film = Film(lambda ns: ns)
    film.show(20)
    film.stamp = lambda ns: ns - 500 * S
    faults = [judged.fault for _, judged in film.show(9) if isinstance(judged, Disbelieved)]
    assert faults == [FrameFault.IMPLAUSIBLE_TIME] * 3 + [FrameFault.CLOCK_UNKNOWN] * 6
    shown = film.show(10)
    assert film.border.epoch is Epoch.FREE
    assert all(isinstance(judged, Believed) for _, judged in shown)


def test_a_stamp_that_fits_no_interval_is_dropped_by_name() -> None:
    """A late stamp is dropped, the next image is believed again; a stamp of the future is never believed."""
    film = Film(lambda ns: ns)
    film.show(20)
    [(_, late)] = film.show(late_ns=12 * MS)
    assert late == Disbelieved(FrameFault.IMPLAUSIBLE_TIME)
    [(_, next_one)] = film.show()
    assert isinstance(next_one, Believed)
    [(_, future)] = film.show(late_ns=2 * S)
    assert future == Disbelieved(FrameFault.IMPLAUSIBLE_TIME)


def test_what_the_browser_dropped_is_counted() -> None:
    """Gaps in the numbers count as far as the browser says that it dropped them; a number that does not grow is stale."""
    film = Film(lambda ns: ns)
    film.show(20)
    film.number, film.dropped = 25, 4
    [(_, judged)] = film.show()
    assert isinstance(judged, Believed)
    assert judged.missed == 4
    film.number -= 1
    assert film.show()[0][1] == Disbelieved(FrameFault.STALE)


def test_a_turned_or_other_sized_image_is_never_used() -> None:
    """The first image says how the camera is turned and how large its images are."""
    film = Film(lambda ns: ns)
    film.show(10)
    assert film.show(shot=replace(SHOT, rotation=90))[0][1] == Disbelieved(FrameFault.TURNED)
    wide = replace(SHOT, width=4, payload=bytes(8))
    assert film.show(shot=wide)[0][1] == Disbelieved(FrameFault.OTHER_SIZE)
    assert film.show(shot=replace(SHOT, payload=b"x"))[0][1] == Disbelieved(FrameFault.WRONG_LENGTH)
    assert isinstance(film.show()[0][1], Believed)
    assert film.show(shot=replace(SHOT, rotation=270))[0][1] == Disbelieved(FrameFault.TURNED)


def test_without_a_clock_no_image_is_believed() -> None:
    """Nor one that says it was handed over after it arrived."""
    film = Film(lambda ns: ns)
    clock, film.clock = film.clock, BrowserClock(20_000)
    assert film.show()[0][1] == Disbelieved(FrameFault.CLOCK_UNKNOWN)
    film.clock = clock
    film.show(10)
    exposed_ns = START + film.number * PERIOD
    shot = replace(SHOT, stamp_us=exposed_ns / 1000, callback_us=(exposed_ns + S + ORIGIN) / 1000)
    judged = film.border.judge(shot.packed(99, 0, shot.callback_us), exposed_ns, clock, ASLEEP)
    assert judged == Disbelieved(FrameFault.IMPLAUSIBLE_TIME)


def test_a_phones_stamp_is_the_beginning_of_the_exposure() -> None:
    """Half of the exposure is added on Android, whose camera stamps the beginning; nowhere else is that known."""
    for is_phone, error_ns in ((True, 4 * MS), (False, 0)):
        film = Film(lambda ns: ns - 8 * MS, hello=replace(HELLO, is_phone=is_phone))
        shown = film.show(20, shot=replace(SHOT, exposure_us=8000))[8:]
        assert errors(shown) == [error_ns - 8 * MS] * 12


def test_a_track_that_comes_back_goes_on() -> None:
    """The same track keeps its epoch and numbers; another one begins anew."""
    film = Film(lambda ns: ns)
    film.show(10)
    film.border.begin(HELLO, is_same_machine=True)
    assert isinstance(film.show()[0][1], Believed)
    film.border.begin(replace(HELLO, track="u"), is_same_machine=True)
    assert film.show()[0][1] == Disbelieved(FrameFault.CLOCK_UNKNOWN)


def judged(stamps: list[int]) -> list[bool]:
    """Which stamps fit."""
    intervals = Intervals()
    return [intervals.fits(stamp) for stamp in stamps]


def test_even_stamps_fit_and_gaps_do_no_harm() -> None:
    """Whole images may be missing, and a little jitter is every camera's."""
    random = np.random.default_rng(5)
    kept = [n for n in range(300) if random.random() > 0.2]
    stamps = [START + n * PERIOD + round(random.normal(0, MS)) for n in kept]
    assert all(judged(stamps))


def test_a_camera_that_slows_down_is_followed() -> None:
    """In dim light a camera halves its rate or takes a third off; after some images, all fit again."""
    for factor in (1.5, 2.0, 0.5):
        stamps = [n * PERIOD for n in range(30)]
        stamps += [stamps[-1] + round((n + 1) * PERIOD * factor) for n in range(40)]
        assert all(judged(stamps)[50:]), factor


def test_single_late_stamps_are_found() -> None:
    """A third of a period late: only that image is dropped. A stamp that does not grow never fits."""
    stamps = [n * PERIOD for n in range(60)]
    for n in (30, 40, 50):
        stamps[n] += PERIOD // 3
    assert [n for n, fits in enumerate(judged(stamps)) if not fits] == [30, 40, 50]
    assert judged([5, 5, 4])[1:] == [False, False]
    assert Intervals().period_ns is None


def test_coarse_stamps_without_a_clock_are_believed_and_their_step_is_told() -> None:
    """Firefox stamps in steps of 11.6 ms: nothing is dropped for it, and the uncertainty contains it."""
    step = 11_609_977
    film = Film(lambda ns: (ns - START) // step * step)
    shown = film.show(200)[20:]
    assert film.border.epoch is Epoch.FREE
    for exposed_ns, judged in shown:
        assert isinstance(judged, Believed)
        assert abs(judged.exposed.ns - exposed_ns) <= judged.exposed.uncertainty_ns + 3 * MS
        assert step <= judged.exposed.uncertainty_ns <= 2 * step + 2 * MS


def test_a_shifted_grid_is_believed_at_the_third_image() -> None:
    """A camera that was restarted keeps its rate on another grid."""
    stamps = [n * PERIOD for n in range(30)]
    stamps += [stamps[-1] + PERIOD // 2 + (n + 1) * PERIOD for n in range(20)]
    fits = judged(stamps)
    assert fits[30:32] == [False, False]
    assert all(fits[32:])
