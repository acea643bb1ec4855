"""What is said of the image files as a whole: which have no partner, and how they were paired."""

from typing import Final

from common.words import counted
from phone_host.report.stereo_report import Remark, distinct_names
from phone_host.stereo.view_files import ViewFiles

_MOST_NAMES: Final = 5


def files_remarks(files: ViewFiles, matcher_note: str = "") -> tuple[Remark, ...]:
    """Say which images have no partner, if pairs were guessed, and how the matcher was chosen.

    Args:
        files: of both sides.
        matcher_note: what is to be said of the choice of the matcher; empty: nothing.
    """
    remarks = []
    for side, paths in (("left", files.left_alone), ("right", files.right_alone)):
        if paths:
            alone = list(distinct_names([*map(str, paths)]).values())
            named = ", ".join(alone[:_MOST_NAMES]) + (", …" if len(alone) > _MOST_NAMES else "")
            remarks.append(
                Remark(f"{counted(len(alone), f'{side} image has', f'{side} images have')} no partner: {named}")
            )
    are_unequal = bool(files.left_alone or files.right_alone)
    if not files.by_number and not files.by_name and (len(files.pairs) > 1 or are_unequal):
        unequal = " though the counts differ" if are_unequal else ""
        remarks.append(
            Remark(
                f"the images were paired in the order of their names{unequal}, because the names share neither numbers nor words",
                "check that each pair shows one moment, or give the two images of a moment the same number",
            )
        )
    return (*remarks, Remark(matcher_note, is_note=True)) if matcher_note else tuple(remarks)
