"""rig.yaml as phone-host calibrate writes it: what an earlier one holds, and the new one does not, is moved aside."""

from pathlib import Path

from common.errors import DataError, UnavailableError
from common.places import Kind, kind_of
from phone_host.calibration.solve.earlier_views import new_ones, pairs_of
from phone_host.model import Rectification, Rig
from phone_host.output.atomic import replacing
from phone_host.output.rig_views import RigViews
from phone_host.output.rig_yaml import is_rig, read_rig, read_rig_views, write_rig


def replace_rig(
    place: Path, out: Path, rig: Rig | None, rectification: Rectification | None, views: RigViews | None = None
) -> str:
    """Write rig.yaml. Keep an earlier one that the new one does not replace: because it is of use and the new one is not, or because its views would be lost.

    If there is nothing to write, a mistake of the user's was found, not of the earlier rig: that stays where it is.

    Args:
        place: folder for the new file, from which it takes the place of the earlier one later.
        out: the earlier file.
        rig: the new rig; None: there is none.
        rectification: of the rig; None: it cannot be rectified, and is not written.
        views: what it was computed from; None: not known.

    Returns:
        The name that the earlier rig has then, if it is not replaced; empty: there was none, or the new one takes its place.

    Raises:
        OSError: a file cannot be written.
    """
    if rig is None or rectification is None:
        return "" if kind_of(out) is Kind.MISSING else out.name
    write_rig(place / out.name, rig, rectification, views)
    is_of_use = not rig.is_rejected
    if kind_of(out) is Kind.MISSING or _is_rejected(out) or (is_of_use and _holds(views, out)):
        return ""
    aside = _aside(out)
    with replacing(place / aside.name) as copy:
        copy.write(out.read_bytes())
    return aside.name


def require_own(out: Path) -> None:
    """Refuse to replace a file that is no calibration.

    Raises:
        UnavailableError: it is none.
    """
    if kind_of(out) is not Kind.MISSING and not is_rig(out):
        raise UnavailableError(f"{out} is not a calibration, and would be replaced", "name another --out")


def _is_rejected(path: Path) -> bool:
    """Return whether an earlier rig was rejected itself: it may be replaced, and does not take the place of a good one in rig.yaml.old."""
    try:
        return read_rig(path).is_rejected
    except DataError:
        return False


def _holds(views: RigViews | None, path: Path) -> bool:
    """Return whether a file has no views but these."""
    earlier = _views_in(path)
    return earlier is None or not new_ones([] if views is None else pairs_of(views), pairs_of(earlier))


def _aside(out: Path) -> Path:
    """Return the name for an earlier rig. One without views takes the place of none that has some."""
    aside = out.with_name(f"{out.name}.old")
    return aside if _views_in(out) is not None or _views_in(aside) is None else out.with_name(f"{out.name}.old2")


def _views_in(path: Path) -> RigViews | None:
    try:
        return read_rig_views(path)
    except DataError:  # it is missing, or no rig
        return None
