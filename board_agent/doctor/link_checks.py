"""Judges a configured link from readings: can this side have it, or who has it? Pure."""

from dataclasses import dataclass

from common.diagnostic import Diagnostic
from common.doctor.access import Holder
from common.doctor.finding import fail, ok, warn


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkReadings:
    """What was found out about one link.

    Attributes:
        uri: as configured.
        holders: processes that have it open.
        all_seen: whether every process could be inspected.
        console: whether the kernel's console writes to it.
        terminals: processes whose controlling terminal it is, such as a getty.
        failure: why it could not be opened; None: it could, or was not tried.
        taken: whether the reason is that another process has it.
    """

    uri: str
    holders: tuple[Holder, ...] = ()
    all_seen: bool = True
    console: bool = False
    terminals: tuple[Holder, ...] = ()
    failure: Diagnostic | None = None
    taken: bool = False


def check_link(link: LinkReadings, service_pid: int) -> Diagnostic:  # noqa: PLR0911 - one for each state of a link
    """Judge a link."""
    port = link.uri.partition("?")[0].rpartition("/")[2]
    if link.terminals:
        unit = f"serial-getty@{port}" if any("getty" in holder.name for holder in link.terminals) else ""
        remedy = f"systemctl disable --now {unit}" if unit else "end it: two readers share the bytes"
        return fail("link", f"{link.uri}: {', '.join(map(str, link.terminals))} has it as its terminal", remedy)
    if link.console:
        return fail(
            "link",
            f"{link.uri}: the kernel's console writes to it",
            f"remove console={port} from the boot command line",
        )
    if service_pid and any(holder.pid == service_pid for holder in link.holders):
        return ok("link", f"{link.uri}: our own service has it (pid {service_pid})")
    if link.holders:
        names = ", ".join(map(str, link.holders))
        return fail("link", f"{link.uri}: {names} has it", "stop that program, or choose another link")
    if link.taken and not link.all_seen:
        return warn("link", f"{link.uri}: taken; by whom, only root may see", "ask again as root: sudo")
    if link.failure is not None:
        return link.failure
    if "//127." in link.uri or "//localhost" in link.uri:
        return ok("link", f"{link.uri}: free; for programs of this machine only")
    return ok("link", f"{link.uri}: free")
