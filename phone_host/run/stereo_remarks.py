"""What the user must know about pairs of image files: which have no partner, whether the depth of each can be right, and why not."""

from dataclasses import replace
from typing import Final

from common.diagnostic import Diagnostic, Severity
from common.orientation import UPRIGHT, Orientation
from common.words import counted, distance_text
from phone_host.diagnostics.arrangement import ImageSource, with_final_options
from phone_host.diagnostics.codes import REJECTED_RIG, Code, as_remark, gravest_first
from phone_host.diagnostics.drift import stills_remedy, stills_words
from phone_host.diagnostics.headline import answer
from phone_host.diagnostics.image_rules import image_doubts, median_figures
from phone_host.diagnostics.run_rules import no_depth
from phone_host.model import Drift, Processed
from phone_host.report.depth_data import density
from phone_host.report.match_words import corrected_words, searched_from_m
from phone_host.report.stereo_report import distinct_names
from phone_host.report.stereo_trust import PairTrust
from phone_host.stereo.core import StereoCore
from phone_host.stereo.evidence import Examined, has_depth, look_at, maps_of
from phone_host.stereo.images import EncodedFile
from phone_host.stereo.reproject import nearest_depth_m
from phone_host.stereo.view_files import ViewFiles

_MOST_NAMES: Final = 5
_UNMATCHED: Final = no_depth(None, None)
_OF_FILES: Final = "check that the scene has texture, and that --calibration or --rectified fits the images"


def files_remarks(files: ViewFiles, matcher_note: str = "") -> tuple[Diagnostic, ...]:
    """Say which images have no partner, if pairs were guessed, and how the matcher was chosen.

    Args:
        files: of both sides.
        matcher_note: what is to be said of the choice of the matcher; empty: nothing.
    """
    remarks = []
    for side, paths, at in (("left", files.left_alone, 1), ("right", files.right_alone, 2)):
        if paths:
            names = distinct_names([*(str(pair[at]) for pair in files.pairs), *map(str, paths)])
            alone = [names[str(path)] for path in paths]
            named = ", ".join(alone[:_MOST_NAMES]) + (", …" if len(alone) > _MOST_NAMES else "")
            remarks.append(
                Diagnostic(f"{counted(len(alone), f'{side} image has', f'{side} images have')} no partner: {named}")
            )
    are_unequal = bool(files.left_alone or files.right_alone)
    if not files.by_number and not files.by_name and (len(files.pairs) > 1 or are_unequal):
        unequal = " though the counts differ" if are_unequal else ""
        remarks.append(
            Diagnostic(
                f"the images were paired in the order of their names{unequal}, because the names share neither numbers nor words",
                "check that each pair shows one moment, or give the two images of a moment the same number",
            )
        )
    return (*remarks, Diagnostic(matcher_note, severity=Severity.NOTE)) if matcher_note else tuple(remarks)


def judge_pair(
    core: StereoCore,
    processed: Processed,
    mounted: tuple[Orientation, Orientation] = (UPRIGHT, UPRIGHT),
    look: Examined | None = None,
) -> PairTrust:
    """Judge one pair.

    Args:
        core: the core that processed it.
        processed: its result.
        mounted: what the user gave to make the left and the right image upright.
        look: what was seen in it; None: it is looked at.
    """
    evidence = (look or look_at(processed, maps_of(core, processed))).evidence
    seen = image_doubts(evidence, ImageSource.FILES)
    found = tuple(with_final_options(concern, mounted, ImageSource.FILES) for concern in seen)
    if not has_depth(processed) and not any(concern.is_failure for concern in found):
        why = no_depth(processed.cut, processed.limits, found)
        # That there are few disparities, too, says nothing more; nor does the cause, once it is named.
        further = (item for item in found if item.code != Code.LOW_DENSITY and item.message not in why.message)
        remedy = _OF_FILES if why == _UNMATCHED else why.remedy
        pixels = "hardly any pixel has" if density(processed) > 0 else "no pixel has"
        sentence = why.message.replace("no pair has", pixels, 1)  # it may be the only pair
        found = gravest_first((replace(why, message=sentence, remedy=remedy), *further))
    if core.rig is not None and core.rig.is_rejected:
        found = gravest_first((REJECTED_RIG, *found))
    figures = median_figures((evidence,))
    error_px = float("nan") if processed.limits is None else processed.limits.disparity_error_px
    # The headline counts the pixels that have a point, where metres are known. What the user has cut away is no loss.
    limits = processed.limits
    is_own_cut = limits is not None and (not limits.from_rig or limits.near_m > 0)
    shown = figures if is_own_cut else replace(figures, density=density(processed))
    return PairTrust(figures, found, answer(shown, found, processed.geometry, error_px, processed.cut))


def pair_remarks(processed: Processed, trust: PairTrust, near_m: float) -> tuple[Diagnostic, ...]:
    """Find what must be said about a pair.

    Args:
        processed: the pair.
        trust: how its images were judged.
        near_m: nearest depth that was looked for, m; NaN: the search was given in px.

    Returns:
        The remarks; doubts come first, gravest first.
    """
    remarks = [as_remark(concern) for concern in trust.concerns]
    geometry, search = processed.geometry, processed.search
    from_m = searched_from_m(geometry, search)
    # N is rounded up to what reaches near_m, unless the images' width bounds it. NaN is never greater.
    if geometry and search and search.disparities and nearest_depth_m(geometry, search.disparities) > near_m:
        remarks.append(
            Diagnostic(
                f"nothing nearer than {distance_text(from_m)} is found: at {distance_text(near_m)} the two views of this rig share"
                " less than half of their width"
            )
        )
    if geometry is None:
        remarks.append(
            Diagnostic(
                "no cloud.ply, xyz.pfm and depth.png, because focal length and baseline are unknown",
                "give --focal PX --baseline MM",
            )
        )
    if corrected := corrected_words(processed.match_report, processed.pair.epipolar):
        remarks.append(Diagnostic(corrected, severity=Severity.NOTE))
    return tuple(remarks)


def turned_remarks(*files: EncodedFile) -> tuple[Diagnostic, ...]:
    """Say which images were turned because of their EXIF headers."""
    return tuple(
        Diagnostic(f"{file.name} was turned upright, as its EXIF header says", severity=Severity.NOTE)
        for file in files
        if file.head.orientation != UPRIGHT
    )


def drift_remarks(drift: Drift | None) -> tuple[Diagnostic, ...]:
    """Return what is to be said of the rig of several pairs: a warning if it no longer stands as it was calibrated.

    Args:
        drift: with pairs for seconds; None without a rig.
    """
    if drift is None:
        return ()
    remedy = stills_remedy(drift)
    return (Diagnostic(stills_words(drift), remedy, Severity.WARN if remedy else Severity.NOTE),)
