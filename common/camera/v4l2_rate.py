"""Tells the log when a camera's measured rate differs from the nominal one: in dim light, or on a full bus."""

import logging

from common.camera.v4l2_stamps import RateMeter, rate_remedy
from common.program.logs import event

_LOG = logging.getLogger(__name__)


class RateWatch:
    """Remembers whether the rate was off, so that each change is told once."""

    def __init__(self) -> None:
        self._is_off = False

    def watch(self, rate: RateMeter, nominal_ns: int, exposure_ns: int | None) -> None:
        """Report once when the rate differs from the nominal one, and once when it no longer does.

        Args:
            rate: the measured rate.
            nominal_ns: period that the camera was asked for, ns.
            exposure_ns: exposure time now, ns; None: not known.
        """
        if rate.differs_from(nominal_ns) is self._is_off:
            return
        self._is_off = not self._is_off
        period_ns = rate.period_ns or 1
        figures = {"period_ms": round(period_ns / 1e6, 2), "nominal_ms": round(nominal_ns / 1e6, 2)}
        if self._is_off:
            _LOG.warning(event("rate_differs", **figures, remedy=rate_remedy(period_ns, nominal_ns, exposure_ns)))
        else:
            _LOG.info(event("rate_nominal", **figures))
