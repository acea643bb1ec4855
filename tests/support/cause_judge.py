"""Names the mistake of a made series the way `phone-host calibrate` does, from corners or from images."""

from common.diagnostic import Diagnostic
from common.errors import DataError
from phone_host.calibration.failure_modes.name import BoardSeries, name_mistake
from phone_host.calibration.solve.calibrate import calibrate
from phone_host.calibration.solve.verdict import Calibration
from phone_host.calibration.target.corners import agree, find_corners
from phone_host.calibration.target.pairs import BoardPair
from phone_host.calibration.target.sharpness import SeenLook, look_at
from phone_host.model import Side
from tests.support.cause_series import Made


def finding_of(made: Made) -> Diagnostic | None:
    """What a series's views tell."""
    pairs, looks = list(made.pairs), list[SeenLook]()
    for index, images in enumerate(made.images):
        corners = []
        for side, image in zip(Side, images, strict=True):
            corners.append(find_corners(image, made.board))
            looks.append(SeenLook(f"{side.value}{index}", side, look_at(image, corners[-1], made.board)))
        if len(corners[0]) and len(corners[1]):
            pairs.append(BoardPair(str(index), corners[0], agree(corners[0], corners[1], made.board)))
    series = BoardSeries(
        pairs=tuple(pairs),
        board=made.board,
        sizes_px=made.sizes_px,
        looks=tuple(looks),
        baseline_m=made.baseline_m,
    )
    found: Calibration | DataError
    try:
        found = calibrate(pairs, made.board, made.sizes_px)
    except DataError as failure:
        found = failure
    return name_mistake(series, found)
