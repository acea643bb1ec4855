"""What the user of `stereo` must know about a pair's result. Doubts that are found in the images belong here, too."""

import math

from common.orientation import UPRIGHT
from phone_host.measure.trust import Doubt
from phone_host.model import Processed
from phone_host.output.pair_files import WrittenPair
from phone_host.report.stereo_report import Remark
from phone_host.report.stereo_trust import PairTrust
from phone_host.stereo.images import EncodedFile
from phone_host.stereo.reproject import nearest_depth_m


def pair_remarks(processed: Processed, written: WrittenPair, trust: PairTrust, near_m: float) -> tuple[Remark, ...]:
    """Find what must be said about a pair.

    Args:
        processed: the pair.
        written: its files.
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
            is_blocking=concern.doubt.blocks and concern.doubt is not Doubt.NO_DEPTH,
        )
        for concern in trust.concerns
    ]
    geometry, search = processed.geometry, processed.search
    if geometry is not None and search is not None and search.disparities and not math.isnan(near_m):
        nearest_m = nearest_depth_m(geometry, search.disparities)
        if nearest_m > near_m:
            remarks.append(
                Remark(
                    f"nothing nearer than {nearest_m * 1e3:.0f} mm is found: at {near_m * 1e3:g} mm the two views of this rig share"
                    " less than half of their width"
                )
            )
    if written.not_in_depth_png:
        remarks.append(
            Remark(
                f"{written.not_in_depth_png} depths are missing in depth.png, which holds 1 mm to 65.5 m",
                "take them from xyz.pfm",
            )
        )
    if geometry is None:
        remarks.append(
            Remark(
                "no cloud.ply, xyz.pfm and depth.png, because focal length and baseline are unknown",
                "give --focal PX --baseline MM",
            )
        )
    return tuple(remarks)


def turned_remarks(*files: EncodedFile) -> tuple[Remark, ...]:
    """Say which images were turned because of their EXIF headers.

    Args:
        files: the pair's image files.
    """
    return tuple(
        Remark(f"{file.name} was turned upright, as its EXIF header says")
        for file in files
        if file.head.orientation != UPRIGHT
    )
