"""A report of `quality` made from planes of geometry, without images."""

import math

import numpy as np

from common.diagnostic import Diagnostic
from phone_host.model import Crop, PlaneQuality, StereoGeometry
from phone_host.output.residual_view import residual_jpeg
from phone_host.report.quality_report import MeasuredPair, QualityReport
from phone_host.report.stereo_report import FailedPair
from phone_host.stereo.plane_quality import NoTruth, StatedDistance, measure_plane

GEOMETRY = StereoGeometry(focal_px=400.0, baseline_m=0.1, cx_px=79.5, cy_px=59.5)
SIGMA_PX = 0.1
WHOLE = Crop(x_px=0, y_px=0, width_px=160, height_px=120)


def quality(distance_m: float, stated_m: float = math.nan, bulge_px: float = 0.0, known: float = 1.0) -> PlaneQuality:
    """The figures of a wall that faces the cameras, with noise; bulged, or known in a share of the columns only."""
    y, x = np.mgrid[:120, :160].astype(np.float64)
    disparity = GEOMETRY.focal_px * GEOMETRY.baseline_m / distance_m + np.random.default_rng(6).normal(
        0, SIGMA_PX, x.shape
    )
    disparity += bulge_px * np.cos(x / 30) * np.cos(y / 30)
    disparity[:, round(known * 160) :] = np.nan
    truth = NoTruth(79.5, 59.5) if math.isnan(stated_m) else StatedDistance(distance_m=stated_m)
    counts = np.ones(x.shape, np.bool_)
    return measure_plane(disparity.astype(np.float32), GEOMETRY, counts, area=WHOLE, truth=truth)


def pair(name: str, found: PlaneQuality, *remarks: Diagnostic) -> MeasuredPair:
    """A pair with these figures."""
    return MeasuredPair(
        name=name,
        left=f"left/{name}",
        right=f"right/{name}",
        rectified_px=(160, 120),
        geometry=GEOMETRY,
        quality=found,
        calibration_error_m=0.002,
        board_misfit_px=math.nan,
        corners_bias_share=math.nan,
        picture=residual_jpeg(np.zeros((120, 160), np.float32), found.roi, 0.5, 160)
        if math.isfinite(found.rms_m)
        else b"",
        picture_range_px=0.5,
        remarks=remarks,
    )


def report(*pairs: MeasuredPair, failed: bool = False) -> QualityReport:
    """A report of these pairs, or of one wall at 1 m that was stated at 0.99 m; perhaps one more that failed."""
    given = pairs or (pair("1.png", quality(1.0, 0.99)),)
    more = (
        FailedPair(name="9.png", left="left/9.png", right="right/9.png", failure=Diagnostic("it is torn", "mend it")),
    )
    return QualityReport(pairs=(*given, *(more if failed else ())), matcher="tandem")
