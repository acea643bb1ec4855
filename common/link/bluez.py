"""What BlueZ's daemon does for an RFCOMM link: it publishes the service's record, and knows devices by name.

The link listens and dials with sockets of its own, so a missing daemon costs no more than the name (decision 0012).
"""

import logging
import threading
from typing import Final

from common.errors import UnavailableError
from common.link.dbus import Call, Kind, SystemBus, Variant
from common.link.sdp import SERVICE_UUID, record_xml
from common.logs import event

_LOG = logging.getLogger(__name__)

_BLUEZ: Final = "org.bluez"
_RETRY_S: Final = 5.0
"""A bus that is not there is looked for again after this time; once it is, nothing is asked for twice."""

_GOODBYE_S: Final = 1.0

_APPEARED: Final = f"type='signal',sender='org.freedesktop.DBus',member='NameOwnerChanged',arg0='{_BLUEZ}'"


class PublishedRecord:
    """Keeps the service's record in the daemon's directory for as long as this lives, also when the daemon is restarted; in a thread.

    Args:
        channel: where the link listens.
    """

    def __init__(self, channel: int) -> None:
        self._channel = channel
        self._bus: SystemBus | None = None
        self._stop = threading.Event()
        self._problem = ""
        self._thread = threading.Thread(target=self._run, name="record", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Withdraw it."""
        self._stop.set()
        if (bus := self._bus) is not None:  # the thread may let go of it at this moment
            bus.interrupt()
        self._thread.join(_GOODBYE_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                self._bus = SystemBus()
                self._keep(self._bus)
            except UnavailableError as error:
                self._note(error.problem)
            if self._bus is not None:
                self._bus.close()
            self._bus = None
            self._stop.wait(_RETRY_S)

    def _keep(self, bus: SystemBus) -> None:
        """Register now and whenever the daemon appears; BlueZ forgets the record when this conversation ends."""
        bus.call(_to_bus("AddMatch", _APPEARED))
        if bus.call(_to_bus("NameHasOwner", _BLUEZ))[0]:
            self._register(bus)
        else:
            self._note("bluetoothd is not running")
        while not self._stop.is_set():
            message = bus.next_message()
            if message.kind is Kind.SIGNAL and message.member == "NameOwnerChanged" and message.arguments[2]:
                self._register(bus)

    def _register(self, bus: SystemBus) -> None:
        options = {
            "Name": Variant("s", "tandemscan"),
            "Role": Variant("s", "server"),
            "ServiceRecord": Variant("s", record_xml(self._channel)),
        }
        arguments = ("/tandemscan", str(SERVICE_UUID), options)
        call = Call(
            _BLUEZ, "/org/bluez", "org.bluez.ProfileManager1", "RegisterProfile", "osa{sv}", arguments
        )  # no channel among the options: with one BlueZ would listen there itself
        bus.call(call)
        self._problem = ""
        _LOG.info(event("bluetooth_record_published", channel=self._channel))

    def _note(self, problem: str) -> None:
        if problem != self._problem and not self._stop.is_set():
            self._problem = problem
            hint = "hosts must name the board's address"
            _LOG.warning(event("bluetooth_record_missing", channel=self._channel, problem=problem, hint=hint))


def address_of(name: str) -> str:
    """Find a device by name, among those that BlueZ's daemon knows.

    Args:
        name: as the device calls itself or as the user has called it; upper and lower case are the same.

    Returns:
        Its address.

    Raises:
        UnavailableError: none is known by this name, or several are, or no daemon can be asked.
    """
    bus = SystemBus()
    try:
        (objects,) = bus.call(Call(_BLUEZ, "/", "org.freedesktop.DBus.ObjectManager", "GetManagedObjects"))
    finally:
        bus.close()
    devices = [interfaces["org.bluez.Device1"] for interfaces in objects.values() if "org.bluez.Device1" in interfaces]
    named = {
        device["Address"].value
        for device in devices
        if name.casefold() in {device[key].value.casefold() for key in ("Name", "Alias") if key in device}
    }
    if len(named) == 1:
        address: str = named.pop()
        return address
    if not named:
        raise UnavailableError(
            f"no Bluetooth device of the name {name!r} is known", "pair with it: bluetoothctl, scan on, pair ADDRESS"
        )
    raise UnavailableError(
        f"{len(named)} Bluetooth devices have the name {name!r}", f"give an address: {', '.join(sorted(named))}"
    )


def _to_bus(member: str, argument: str) -> Call:
    return Call("org.freedesktop.DBus", "/org/freedesktop/DBus", "org.freedesktop.DBus", member, "s", (argument,))
