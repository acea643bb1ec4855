"""The names of the matchers, ours and those of other packages. Light, because settings and help need the names but not the algorithms.

The file of a learned matcher says which shapes it takes and gives, but not what it makes of the numbers. So that stands in its
name, `onnx:PATH[?OPTION=VALUE[&OPTION=VALUE]]`.
"""

from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeVar

from common.errors import SettingsError
from common.program.extensions import registered_names

PREFIX: Final = "onnx:"


class Levels(Enum):
    """What a network takes for the grey levels 0 to 255.

    UNIT: 0 to 1. BYTES: 0 to 255. IMAGENET: 0 to 1, less the mean and divided by the deviation of ImageNet's channels
    (Krizhevsky et al., NIPS 2012; the constants are torchvision's).
    """

    UNIT = "unit"
    BYTES = "bytes"
    IMAGENET = "imagenet"


class Sign(Enum):
    """What a network gives: the disparity, or its opposite, the flow along x from the left image to the right one."""

    DISPARITY = "disparity"
    FLOW = "flow"


class Check(Enum):
    """Whether the network also matches the mirrored pair, and only what both agree on counts. It takes twice the time."""

    YES = "yes"
    NO = "no"


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkMatcher:
    """A learned matcher: a network in a file.

    Attributes:
        value: the name as a user types it.
        path: of the ONNX file.
        levels: `input=`.
        sign: `output=`.
        check: `check=`.
    """

    value: str
    path: str
    levels: Levels = Levels.UNIT
    sign: Sign = Sign.DISPARITY
    check: Check = Check.YES


_Choice = TypeVar("_Choice", Levels, Sign, Check)


def network_named(text: str) -> NetworkMatcher:
    """Read a name that begins with `onnx:`. Nothing is opened.

    Raises:
        SettingsError: there is no path, or an option is unknown or has a value that it cannot have.
    """
    path, mark, tail = text.removeprefix(PREFIX).partition("?")
    if not path:
        raise SettingsError(f"matcher {text!r} names no file", "give onnx:PATH, a network in ONNX format")
    given = dict.fromkeys(("input", "output", "check"), "")
    for part in tail.split("&") if mark else ():
        key, _, value = part.partition("=")
        if key not in given or given[key]:
            raise SettingsError(
                f"matcher {text!r} has the option {part!r}", "give input=, output= and check= at most once each"
            )
        given[key] = value or "nothing"
    return NetworkMatcher(
        value=text,
        path=path,
        levels=_choice(text, "input", given["input"], Levels.UNIT),
        sign=_choice(text, "output", given["output"], Sign.DISPARITY),
        check=_choice(text, "check", given["check"], Check.YES),
    )


def _choice(text: str, key: str, value: str, default: _Choice) -> _Choice:
    if not value:
        return default
    kind = type(default)
    try:
        return kind(value)
    except ValueError:
        known = ", ".join(f"{key}={one.value}" for one in kind)
        raise SettingsError(f"matcher {text!r} has the option {key}={value}", f"give one of {known}") from None


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
