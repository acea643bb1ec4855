"""Settings of both kinds of camera that follow the automaton of `common.camera.life`."""

from dataclasses import replace

import pytest

from common.camera.life import NEVER_NS, LifeSettings, Unwanted

S = 1_000_000_000
"""A second, ns."""

DEVICE = LifeSettings(
    start_ns=3 * S,
    first_frame_ns=3 * S,
    silence_ns=S,
    silence_periods=10,
    lost_rest_ns=0,
    rest_ns=S // 5,
    longest_rest_ns=S // 5,
    unwanted=Unwanted.STAYS_OPEN,
    look_ns=S,
)
SERVER = replace(
    DEVICE,
    start_ns=10 * S,
    first_frame_ns=2 * S,
    silence_ns=2 * S,
    lost_rest_ns=S // 10,
    rest_ns=S // 10,
    longest_rest_ns=S,
    unwanted=Unwanted.IS_CLOSED,
    look_ns=NEVER_NS,
)

BOTH = pytest.mark.parametrize("settings", [DEVICE, SERVER], ids=["device", "server"])
"""Runs a test with each."""
