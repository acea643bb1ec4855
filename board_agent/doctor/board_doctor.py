"""board-agent doctor: everything that keeps a board from streaming, each with its remedy. Checks live in common/doctor."""

import stat
from dataclasses import replace
from pathlib import Path
from typing import Final
from urllib.parse import urlsplit

from board_agent.doctor.link_checks import LinkReadings, check_link
from board_agent.settings import BoardSettings, key_folder
from common.diagnostic import Diagnostic, Severity
from common.doctor import machine
from common.doctor.access import Account, Holder, check_access
from common.doctor.camera_probe import examine_camera
from common.doctor.finding import fail, ok, warn
from common.doctor.machine_checks import check_bluetooth, check_clocks, check_disk, check_power, check_usb_log
from common.doctor.network_probe import examine_network
from common.doctor.package_probe import missing_packages
from common.doctor.unit_check import Unit, check_unit
from common.errors import TakenError, TandemError
from common.keys import SERVICE_FOLDER, KeyFolder
from common.link.factory import needs_keys, open_link, parse_link

UNIT: Final = "board-agent"

_MODULES: Final = ("msgpack", "serial", "zmq")
"""Modules of the packages that the board's package depends on (deploy/board/debian/control)."""

_LOG_FOLDERS: Final = (Path("/var/log/journal"), Path("/run/log/journal"))


def examine(settings: BoardSettings | None) -> list[Diagnostic]:
    """Check this machine for a run with the given settings.

    Args:
        settings: what would be run; None: that is not known, so camera, links and keys are left out.

    Returns:
        The findings, in the order in which problems would appear.

    Raises:
        SettingsError: the camera's or a link's URI makes no sense.
    """
    unit = machine.read_unit(UNIT)
    account = machine.account_of(unit.user) if unit.installed and unit.user else None
    user = account or machine.own_account()
    missing = missing_packages(_MODULES)
    findings = [check_unit(unit), *missing]
    if settings is not None:
        findings += _examine_camera(settings, user, unit)
    if settings is not None and not missing:  # without its packages no link can be tried
        findings += _examine_links(settings, user, unit, is_service=account is not None)
    log = machine.read_kernel_log()
    findings += check_clocks(machine.read_clocks(Path(__file__).parent))
    folders = [Path("/"), *(folder for folder in _LOG_FOLDERS if folder.is_dir())]
    devices = {folder.stat().st_dev: folder for folder in reversed(folders)}
    findings += [check_disk(machine.read_disk(folder)) for folder in reversed(devices.values())]
    findings += [check_power(log, machine.read_supply()), check_usb_log(log)]
    return findings


def _examine_camera(settings: BoardSettings, user: Account, unit: Unit) -> list[Diagnostic]:
    """Check what the frames come from."""
    if settings.camera:
        return list(examine_camera(settings.camera, user, unit))
    return [fail("camera", "none is configured", "give --camera v4l2:auto, or set camera in the settings file")]


def _examine_links(settings: BoardSettings, user: Account, unit: Unit, *, is_service: bool) -> list[Diagnostic]:
    """Check where the frames go."""
    findings: list[Diagnostic] = []
    for uri in settings.link:
        findings += examine_link(uri, user, unit, listens_by_default=True)
    if any(needs_keys(parse_link(uri, listens_by_default=True)) for uri in settings.link):
        of_service = is_service and not settings.keys
        findings.append(check_keys(KeyFolder(SERVICE_FOLDER) if of_service else key_folder(settings.keys), user))
    return findings


def check_keys(folder: KeyFolder, account: Account) -> Diagnostic:  # noqa: PLR0911 - one for each state of the folder
    """Judge a board's key folder."""
    path = folder.path
    try:
        if not path.exists():
            return warn("keys", f"{path} is not there yet, so nobody is known", "start the agent, then pair a host")
        # Key files are for their owner only, so whoever must read them must own them; root may read everything.
        states = {item.name: item.lstat() for item in path.iterdir()}
        owners = {name: state.st_uid for name, state in states.items() if stat.S_ISREG(state.st_mode)}
        if folder.has_key:
            folder.own()
        peers = folder.peers()
    except PermissionError:
        return warn("keys", f"{path} may not be read", "ask again as root: sudo")
    except OSError as error:
        return fail("keys", f"{path} cannot be used ({error.strerror})", "name another folder with --keys")
    except TandemError as error:
        return fail("keys", error.problem, error.remedy)
    foreign = sorted(name for name, uid in owners.items() if uid != account.uid)
    if foreign and account.uid != 0:
        problem = f"{', '.join(foreign)} in {path} may not be read by user {account.name}"
        return fail("keys", problem, f"sudo chown -R {account.name}: {path}")
    if not peers:
        return warn(
            "keys",
            f"{path} knows no host yet",
            "run phone-host pair on the host, and board-agent pair here: it shows the code",
        )
    return ok("keys", f"{path} knows {', '.join(peer.name for peer in peers)}")


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
