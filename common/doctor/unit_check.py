"""Judges a systemd unit from systemctl's output. Pure."""

from dataclasses import dataclass

from common.diagnostic import Diagnostic
from common.doctor.finding import fail, ok, warn
from common.words import times


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit as `systemctl show` describes it.

    Attributes:
        name: its name without suffix.
        load: LoadState; empty if there is no systemd.
        active: ActiveState.
        sub: SubState.
        enabled: UnitFileState.
        result: Result of the last run.
        restarts: NRestarts.
        status: StatusText, one line for people.
        user: User.
        pid: MainPID; 0: it is not running.
    """

    name: str
    load: str = ""
    active: str = ""
    sub: str = ""
    enabled: str = ""
    result: str = ""
    restarts: int = 0
    status: str = ""
    user: str = ""
    pid: int = 0

    @property
    def installed(self) -> bool:
        """Whether systemd knows it."""
        return self.load == "loaded"


def check_unit(unit: Unit) -> Diagnostic:
    """Judge the service's state."""
    if not unit.load:
        return ok("service", "no systemd here: the command runs by itself")
    if not unit.installed:
        return ok("service", f"{unit.name} is not installed as a service")
    restarts = f", restarted {times(unit.restarts)}" if unit.restarts else ""
    journal = f"journalctl -u {unit.name} ends with the reason and the remedy"
    if unit.active == "failed" or unit.sub == "auto-restart":
        return fail("service", f"{unit.name} fails ({unit.result}){restarts}", journal)
    if unit.active != "active":
        return warn("service", f"{unit.name} is {unit.active or 'unknown'}", f"systemctl enable --now {unit.name}")
    said = f"{unit.name} is {unit.active}{restarts}; it says: {unit.status or 'nothing'}"
    if unit.enabled != "enabled":
        return warn("service", f"{said}; it will not start at boot", f"systemctl enable {unit.name}")
    return ok("service", said)
