"""What holds for the automaton of a camera's life, of either kind, whatever happens in whatever order."""

from dataclasses import dataclass, field
from enum import Enum

from hypothesis import given
from hypothesis import strategies as st

from common.camera.base import CameraState
from common.camera.life import Life, LifeSettings, Loss, Standing, Step
from tests.support.camera_lives import BOTH, S


class Chance(Enum):
    """What may happen."""

    TIME = "time"
    FRAME = "frame"
    FAILURE = "failure"
    UNPLUGGED = "unplugged"
    OPENED = "opened"
    REFUSED = "refused"
    CLOSED = "closed"
    PAUSE = "pause"
    RESUME = "resume"
    STEER = "steer"
    RENEW = "renew"
    ACCEPT = "accept"
    END = "end"


@dataclass(slots=True)
class World:
    """A camera and its shell, which does as it is told, but late.

    Attributes:
        life: the automaton.
        now_ns: the time.
        is_open: whether the device is open; None: being opened.
        is_closing: whether CLOSE was ordered and is not done yet.
        tries: openings that were ordered.
        rests_until_ns: no opening may be ordered before this time.
        was_heard: whether a frame has come since it was opened.
    """

    settings: LifeSettings
    life: Life = field(init=False)
    now_ns: int = 0
    is_open: bool | None = False
    is_closing: bool = False
    tries: int = 0
    rests_until_ns: int = 0
    was_heard: bool = False

    def __post_init__(self) -> None:
        self.life = Life(self.settings, 0)

    def obey(self, step: Step) -> None:
        """Begin what was ordered."""
        match step:
            case Step.OPEN:
                assert self.is_open is False, "two openings without a close"
                assert self.now_ns >= self.rests_until_ns, "an opening before its rest was over"
                self.is_open, self.was_heard = None, False
                self.tries += 1
            case Step.CLOSE:
                assert self.is_open
                assert not self.is_closing
                self.is_closing = True
            case Step.START | Step.STOP | Step.LOOK:
                assert self.is_open
                assert not self.is_closing
            case Step.NONE:
                pass

    def rest(self) -> None:
        """An attempt without a frame has ended."""
        self.rests_until_ns = self.now_ns + self.settings.rest_ns

    def lose(self, loss: Loss) -> None:
        """The device fails."""
        step = self.life.lost(loss, self.now_ns)
        if step is Step.CLOSE and not self.was_heard:
            self.rest()
        self.obey(step)

    def report(self, chance: Chance) -> None:
        """Report an outcome, if one is awaited."""
        if chance is Chance.CLOSED and self.is_closing:
            self.is_open = self.is_closing = False
            self.life.closed()
        elif chance is Chance.OPENED and self.is_open is None:
            self.is_open = True
            self.obey(self.life.opened(self.now_ns, S // 30))
        elif chance is Chance.REFUSED and self.is_open is None:
            self.is_open = False
            self.life.refused(self.now_ns)
            self.rest()
        elif chance is Chance.FRAME and self.is_open:
            self.was_heard |= self.life.phase is Standing.STREAMING
            self.life.heard(self.now_ns, S // 30)

    def order(self, chance: Chance) -> None:
        """Pass on an order of the owner; it ends a rest."""
        match chance:
            case Chance.PAUSE:
                self.obey(self.life.pause())
            case Chance.RESUME:
                self.rests_until_ns = 0
                self.obey(self.life.resume(self.now_ns))
            case Chance.STEER:
                self.obey(self.life.steer(self.now_ns + S // 7))
            case Chance.RENEW:
                step = self.life.renew(self.now_ns)
                self.rests_until_ns = 0 if step is Step.CLOSE else self.rests_until_ns
                self.obey(step)
            case Chance.ACCEPT:
                self.life.accept()
            case _:
                self.obey(self.life.end())

    def let(self, chance: Chance, wait_ns: int) -> None:
        """Let this happen, and then whatever time brings."""
        match chance:
            case Chance.TIME:
                self.now_ns += wait_ns
            case Chance.FAILURE:
                self.lose(Loss.FAILED)
            case Chance.UNPLUGGED:
                self.lose(Loss.UNPLUGGED)
            case Chance.OPENED | Chance.REFUSED | Chance.CLOSED | Chance.FRAME:
                self.report(chance)
            case _:
                self.order(chance)
        step = self.life.due(self.now_ns)
        if step is Step.CLOSE and not self.was_heard:
            self.rest()
        self.obey(step)

    def check(self) -> None:
        """What holds at any moment."""
        counts, life = self.life.counts, self.life
        assert self.tries == counts.refused + counts.opened + (self.is_open is None)
        ended = sum(counts.lost.values()) + counts.released
        assert counts.opened == ended + (bool(self.is_open) and not self.is_closing)
        assert counts.returned <= sum(counts.lost.values()) + counts.refused
        assert life.due_ns > self.now_ns
        assert (life.state is CameraState.RUNNING) <= life.is_wanted


HAPPENINGS = st.lists(
    st.tuples(
        st.sampled_from([*Chance] + 3 * [Chance.TIME, Chance.OPENED, Chance.CLOSED]),
        st.integers(1, 4 * S) | st.sampled_from([S // 10, S // 5, S, 2 * S, 10 * S]),
    ),
    max_size=60,
)


@BOTH
@given(happenings=HAPPENINGS)
def test_whatever_happens(settings: LifeSettings, happenings: list[tuple[Chance, int]]) -> None:
    """In any order of events there are never two openings without a close and never an opening before its rest is over, and all counts add up."""
    world = World(settings)
    for chance, wait_ns in happenings:
        world.let(chance, wait_ns)
        world.check()


@BOTH
@given(happenings=HAPPENINGS)
def test_silence_always_ends_in_a_retry(settings: LifeSettings, happenings: list[tuple[Chance, int]]) -> None:
    """Whatever happened before, a camera that is wanted and then silent is reopened within its patience and the longest rest."""
    world = World(settings)
    for chance, wait_ns in happenings:
        if chance is not Chance.END:
            world.let(chance, wait_ns)
    world.let(Chance.RESUME, 0)
    for pending in (Chance.CLOSED, Chance.OPENED):
        world.let(pending, 0)
    tries, until_ns = world.tries, world.now_ns + 2 * settings.start_ns + settings.longest_rest_ns
    while world.tries == tries:
        assert world.life.due_ns <= until_ns
        world.let(Chance.TIME, world.life.due_ns - world.now_ns)
        world.let(Chance.CLOSED, 0)
