"""The names of the matchers, ours and those of other packages. Light, because settings and help need the names but not the algorithms."""

from dataclasses import dataclass
from enum import Enum
from typing import Final

from common.errors import SettingsError
from common.program.extensions import registered_names
from phone_host.stereo.network_name import PREFIX, NetworkMatcher, network_named

MATCHERS: Final = "tandemscan.matchers"
"""Entry points of other packages' matchers; see `match`."""


class MatcherName(Enum):
    """The matchers by the name a user types.

    BLOCK is the paper's: 8 x 8 sum of absolute differences, winner takes all. SGBM is OpenCV's semi-global matching with
    checks of our own. TANDEM is our own semi-global matching, in the native library.
    """

    BLOCK = "block"
    SGBM = "sgbm"
    TANDEM = "tandem"


FALLBACK: Final[MatcherName] = MatcherName.SGBM
"""The matcher that works wherever OpenCV does."""

PREFERRED: Final[MatcherName] = MatcherName.TANDEM
"""The default of all commands, on machines where it works; elsewhere FALLBACK (see `default_matcher`)."""


def default_words(preferred: MatcherName = PREFERRED) -> str:
    """Return what help texts say of the default."""
    if preferred is FALLBACK:
        return f"default {FALLBACK.value}"
    return f"default {preferred.value}, or {FALLBACK.value} where the native library is not built"


@dataclass(frozen=True, slots=True)
class RegisteredMatcher:
    """A matcher that an installed package registers.

    Attributes:
        value: the name under which it is registered.
    """

    value: str


AnyMatcher = MatcherName | RegisteredMatcher | NetworkMatcher


@dataclass(frozen=True, slots=True, kw_only=True)
class UsualCost:
    """What a matcher takes on a usual machine: a first guess, which a run with a time budget corrects by what it measures.

    Attributes:
        step_ns: for each pixel and disparity, ns.
        pixel_ns: for each pixel besides, ns.
    """

    step_ns: float
    pixel_ns: float


BEST_FIRST: Final = {
    MatcherName.TANDEM: UsualCost(step_ns=0.2, pixel_ns=40.0),
    MatcherName.SGBM: UsualCost(step_ns=1.1, pixel_ns=140.0),
    MatcherName.BLOCK: UsualCost(step_ns=2.2, pixel_ns=10.0),
}
"""Our matchers, those with the best depth first (decision 0002). Costs: two cores of a server, 640x480, 32 to 128 disparities."""

FASTEST: Final = MatcherName.TANDEM
"""Of ours, by the costs above."""

_UNKNOWN_COST: Final = UsualCost(step_ns=1.0, pixel_ns=100.0)


def usual_cost(matcher: AnyMatcher) -> UsualCost:
    """Return what a matcher may cost; of other packages' matchers nothing is known."""
    return BEST_FIRST.get(matcher, _UNKNOWN_COST) if isinstance(matcher, MatcherName) else _UNKNOWN_COST


def matcher_named(text: str) -> AnyMatcher:
    """Find the matcher that a user names, without loading it: ours, another package's, or a network's file.

    Raises:
        SettingsError: no matcher has that name, or an option of a network makes no sense.
    """
    if text.startswith(PREFIX):
        return network_named(text)
    own = [name.value for name in MatcherName]
    if text in own:
        return MatcherName(text)
    registered = registered_names(MATCHERS)
    if text in registered:
        return RegisteredMatcher(text)
    raise SettingsError(f"matcher {text!r} is unknown", f"give {' or '.join((*own, *registered))}, or onnx:PATH")
