"""What the host's owner may set once for all runs; every one is an option of `phone-host run` too."""

from dataclasses import dataclass

from common.settings import setting

ENVIRONMENT_PREFIX = "PHONE_HOST"


@dataclass(frozen=True, slots=True)
class PhoneHostSettings:
    """Settings of phone-host run, from a TOML file, the environment and options."""

    link: str = setting("tcp://127.0.0.1:5555", "link to the board")
    camera: str = setting("", "own camera URI, for example replay:PATH?fps=30&loop=1")
    calibration: str = setting("", "rig.yaml of the two cameras")
    matcher: str = setting("sgbm", "stereo matcher")
    tolerance: float = setting(0.0, "greatest time skew of a pair, ms; 0 = half of the longer frame period")
    fifo: str = setting("1:drop-oldest", "DEPTH:POLICY of the queue before the stereo pipeline")
    log_level: str = setting("warning", "debug, info, warning or error")
