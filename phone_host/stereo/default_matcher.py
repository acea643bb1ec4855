"""Which matcher a command uses when nobody names one: the preferred one where it works, else the one that works everywhere."""

from common.diagnostic import Diagnostic
from common.errors import SettingsError
from phone_host.native.library import Library, fallback_note, native
from phone_host.stereo.matcher_names import FALLBACK, PREFERRED, MatcherName


def default_matcher(preferred: MatcherName = PREFERRED, library: Library | Diagnostic | None = None) -> MatcherName:
    """Return the matcher of this machine.

    Args:
        preferred: the one that is wanted.
        library: the native library, which `tandem` needs; None: that of this installation.
    """
    return preferred if _lacking(preferred, library) is None else FALLBACK


def default_note(preferred: MatcherName = PREFERRED, library: Library | Diagnostic | None = None) -> str:
    """Return what a summary says where the default is not the preferred matcher; empty where it is.

    Args:
        preferred: the one that is wanted.
        library: as for `default_matcher`.
    """
    lacking = _lacking(preferred, library)
    return "" if lacking is None else fallback_note(lacking)


def _lacking(preferred: MatcherName, library: Library | Diagnostic | None) -> Diagnostic | None:
    """Return why the preferred matcher does not work; None if it does."""
    if preferred is not MatcherName.TANDEM:
        return None
    try:
        found = native() if library is None else library
    except SettingsError:  # the library is there; whoever computes with it says that TANDEMSCAN_SIMD is wrong
        return None
    return found if isinstance(found, Diagnostic) else None
