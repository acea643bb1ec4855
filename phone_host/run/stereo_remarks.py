"""What the user of `stereo` must know about a pair's result. Doubts that are found in the images belong here, too."""

from common.orientation import UPRIGHT
from common.words import distance_text
from phone_host.measure.drift_words import stills_remedy, stills_words
from phone_host.measure.trust import Doubt
from phone_host.model import Drift, Processed
from phone_host.report.cut_words import searched_from_m
from phone_host.report.match_words import corrected_words
from phone_host.report.stereo_report import Remark
from phone_host.report.stereo_trust import PairTrust
from phone_host.stereo.images import EncodedFile
from phone_host.stereo.reproject import nearest_depth_m


def pair_remarks(processed: Processed, trust: PairTrust, near_m: float) -> tuple[Remark, ...]:
    """Find what must be said about a pair.

    Args:
        processed: the pair.
        trust: how its images were judged.
        near_m: nearest depth that was looked for, m; NaN: the search was given in px.

    Returns:
        The remarks; doubts come first, gravest first.
    """
    # That one pair of several has no depth is told; only if none has any, the command fails.
    remarks = [
        Remark(
            concern.sentence,
            concern.remedy,
            is_blocking=concern.is_certain and concern.doubt is not Doubt.NO_DEPTH,
        )
        for concern in trust.concerns
    ]
    geometry, search = processed.geometry, processed.search
    from_m = searched_from_m(geometry, search)
    # N is rounded up to what reaches near_m, unless the images' width bounds it. NaN is never greater.
    if geometry and search and search.disparities and nearest_depth_m(geometry, search.disparities) > near_m:
        remarks.append(
            Remark(
                f"nothing nearer than {distance_text(from_m)} is found: at {distance_text(near_m)} the two views of this rig share"
                " less than half of their width"
            )
        )
    if geometry is None:
        remarks.append(
            Remark(
                "no cloud.ply, xyz.pfm and depth.png, because focal length and baseline are unknown",
                "give --focal PX --baseline MM",
            )
        )
    if corrected := corrected_words(processed.match_report, processed.pair.epipolar):
        remarks.append(Remark(corrected, is_note=True))
    return tuple(remarks)


def turned_remarks(*files: EncodedFile) -> tuple[Remark, ...]:
    """Say which images were turned because of their EXIF headers.

    Args:
        files: the pair's image files.
    """
    return tuple(
        Remark(f"{file.name} was turned upright, as its EXIF header says", is_note=True)
        for file in files
        if file.head.orientation != UPRIGHT
    )


def drift_remarks(drift: Drift | None) -> tuple[Remark, ...]:
    """Return what is to be said of the rig of several pairs: a warning if it no longer stands as it was calibrated.

    Args:
        drift: with pairs for seconds; None without a rig.
    """
    if drift is None:
        return ()
    remedy = stills_remedy(drift)
    return (Remark(stills_words(drift), remedy, is_note=not remedy),)
