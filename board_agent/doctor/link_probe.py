"""Tries to open each configured link for a moment, or finds out who has it, and lets the checks judge."""

from dataclasses import replace
from pathlib import Path
from urllib.parse import urlsplit

from board_agent.doctor.link_checks import LinkReadings, check_link
from common.diagnostic import Diagnostic, Severity
from common.doctor import machine
from common.doctor.access import Account, Holder, check_access
from common.doctor.finding import fail
from common.doctor.machine_checks import check_bluetooth
from common.doctor.network_probe import examine_network
from common.doctor.unit_check import Unit
from common.errors import TakenError, TandemError
from common.link.factory import open_link, parse_link


def examine_link(uri: str, account: Account, unit: Unit, *, listens_by_default: bool) -> list[Diagnostic]:
    """Check one link.

    Raises:
        SettingsError: the URI makes no sense.
    """
    parsed = parse_link(uri, listens_by_default=listens_by_default)
    findings = []
    address = parsed.address
    if address.startswith("rfcomm:"):
        adapter = check_bluetooth(machine.read_bluetooth(), wanted=True)
        findings.append(adapter)
        if adapter.severity is Severity.FAIL:
            return findings
    if address.startswith("serial:") and (node := machine.read_node(Path(address.removeprefix("serial:")))) is not None:
        findings.append(check_access("permission", node, account))
    findings += examine_network(parsed)
    readings = _readings(uri, address, account, listens=parsed.listens)
    if not (readings.holders or readings.terminals or readings.console):
        readings = _tried(readings, account, listens_by_default=listens_by_default)
    return [*findings, check_link(readings, unit.pid)]


def _readings(uri: str, address: str, account: Account, *, listens: bool) -> LinkReadings:
    """What can be read without opening anything."""
    if address.startswith("serial:"):
        device = Path(address.removeprefix("serial:")).resolve()
        holders, all_seen = machine.holders_of(str(device))
        terminals = machine.terminals_on(device)
        console = machine.is_console(device)
        others = tuple(holder for holder in holders if holder not in terminals)
        return LinkReadings(uri=uri, holders=others, all_seen=all_seen, console=console, terminals=terminals)
    if not listens:
        return LinkReadings(uri=uri)
    if address.startswith("tcp:"):
        targets = machine.socket_targets(urlsplit(address.replace("*", "0.0.0.0")).port)  # noqa: S104 - only to parse it
    elif address.startswith("ipc:"):
        targets = machine.socket_targets(None, address.removeprefix("ipc://"))
    else:
        targets = []
    found: dict[Holder, None] = {}
    seen_all = True
    for target in targets:
        holders, all_seen = machine.holders_of(target)
        seen_all &= all_seen
        found.update(dict.fromkeys(holders))
    # The same port on another address does not concern us, so a holder counts only if opening fails too.
    return (
        LinkReadings(uri=uri, all_seen=seen_all)
        if not found
        else _blamed(uri, tuple(found), account, all_seen=seen_all)
    )


def _blamed(uri: str, holders: tuple[Holder, ...], account: Account, *, all_seen: bool) -> LinkReadings:
    tried = _tried(LinkReadings(uri=uri, all_seen=all_seen), account, listens_by_default=True)
    return LinkReadings(uri=uri, holders=holders, all_seen=all_seen) if tried.taken else tried


def _tried(readings: LinkReadings, account: Account, *, listens_by_default: bool) -> LinkReadings:
    """Open the link and close it again. No keys are used, because none may be created here."""
    try:
        parsed = parse_link(readings.uri, listens_by_default=listens_by_default)
        owner = parsed.owner or (str(account.uid) if parsed.address.startswith("ipc:") else "")
        open_link(replace(parsed, insecure=True, owner=owner)).close()
    except TandemError as error:
        failure = fail("link", error.problem, error.remedy)
        return replace(readings, failure=failure, taken=isinstance(error, TakenError))
    return readings
