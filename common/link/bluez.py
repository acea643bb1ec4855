"""What BlueZ's daemon does for an RFCOMM link: it publishes the service's record and knows devices by name.

The link listens and dials with its own sockets. So if the daemon is missing, or dbus-fast, which is needed to talk to it, only the device names and
the published channel are lost (decision 0012). dbus-fast needs asyncio; nothing else imports it, and its loop runs in its own thread, or for a
single question.
"""

import asyncio
import logging
import threading
from collections.abc import AsyncIterator, Callable
from contextlib import ExitStack, asynccontextmanager, suppress
from functools import partial
from typing import Any, Final

from common.errors import UnavailableError
from common.link.sdp import SERVICE_UUID, record_xml
from common.program.logs import event

try:
    from dbus_fast import AuthError, BusType, InvalidAddressError, Message, MessageType, Variant
    from dbus_fast.aio import MessageBus
except ImportError:
    _HAS_LIBRARY = False
else:
    _HAS_LIBRARY = True

_LOG = logging.getLogger(__name__)

_BLUEZ: Final = "org.bluez"
_BUS: Final = "org.freedesktop.DBus"
_RETRY_S: Final = 5.0
"""A missing bus is looked for again after this time. Once it is there, nothing is asked twice."""

_PATIENCE_S: Final = 5.0
"""An answer takes milliseconds. bluetoothd on a busy board was never seen to need a second."""

_GOODBYE_S: Final = 1.0

_APPEARED: Final = f"type='signal',sender='{_BUS}',member='NameOwnerChanged',arg0='{_BLUEZ}'"


class PublishedRecord:
    """Keeps the service's record in the daemon's directory for as long as this object lives, even if the daemon restarts. Runs in a thread.

    Args:
        channel: channel on which the link listens.
    """

    def __init__(self, channel: int) -> None:
        self._channel = channel
        self._stop = threading.Event()
        self._cancel: Callable[[], object] | None = None
        self._problem = ""
        self._thread = threading.Thread(target=self._run, name="record", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Withdraw the record."""
        self._stop.set()
        if self._cancel is not None:  # otherwise the thread has not begun to wait, and checks _stop before it does
            with suppress(RuntimeError):  # the loop has just been closed
                self._cancel()
        self._thread.join(_GOODBYE_S)

    def _run(self) -> None:
        while not self._stop.is_set():
            try:
                asyncio.run(self._converse())
            except UnavailableError as error:
                self._note(error)
            except asyncio.CancelledError:
                return
            if not _HAS_LIBRARY:
                return
            self._stop.wait(_RETRY_S)

    async def _converse(self) -> None:
        task = asyncio.current_task()
        assert task is not None
        self._cancel = partial(asyncio.get_running_loop().call_soon_threadsafe, task.cancel)
        if not self._stop.is_set():
            async with _system_bus() as bus:
                await self._keep(bus)

    async def _keep(self, bus: "MessageBus") -> None:
        """Register now and whenever the daemon appears. BlueZ forgets the record when this connection ends."""
        changed = asyncio.Event()

        def heard(message: "Message") -> None:
            if message.member == "NameOwnerChanged" and message.body[2]:
                changed.set()

        bus.add_message_handler(heard)
        await _ask(bus, _of_bus("AddMatch", _APPEARED))
        if (await _ask(bus, _of_bus("NameHasOwner", _BLUEZ)))[0]:
            changed.set()
        else:
            self._note(UnavailableError("bluetoothd is not running", "systemctl start bluetooth"))
        gone = asyncio.ensure_future(bus.wait_for_disconnect())
        gone.add_done_callback(lambda _: changed.set())
        while True:
            await changed.wait()
            if gone.done():
                raise UnavailableError(f"D-Bus has gone ({gone.exception()})", "systemctl start dbus")
            changed.clear()
            await self._register(bus)

    async def _register(self, bus: "MessageBus") -> None:
        options = {
            "Name": Variant("s", "tandemscan"),
            "Role": Variant("s", "server"),
            "ServiceRecord": Variant("s", record_xml(self._channel)),
        }  # no channel among the options: with one, BlueZ would listen there itself
        register = Message(
            destination=_BLUEZ,
            path="/org/bluez",
            interface="org.bluez.ProfileManager1",
            member="RegisterProfile",
            signature="osa{sv}",
            body=["/tandemscan", str(SERVICE_UUID), options],
        )
        await _ask(bus, register)
        self._problem = ""
        _LOG.info(event("bluetooth_record_published", channel=self._channel))

    def _note(self, error: UnavailableError) -> None:
        if error.problem != self._problem and not self._stop.is_set():
            self._problem = error.problem
            told = event(
                "bluetooth_record_missing",
                channel=self._channel,
                problem=error.problem,
                remedy=f"{error.remedy}; till then hosts must name the board's address",
            )
            _LOG.warning(told)


def address_of(name: str) -> str:
    """Find a device by name among those that BlueZ's daemon knows.

    Args:
        name: the device's own name or the user's name for it; case is ignored.

    Raises:
        UnavailableError: no device has this name, several have, or no daemon can be asked.
    """
    try:
        objects = asyncio.run(_known_objects())
    except UnavailableError as error:
        raise UnavailableError(
            f"Bluetooth device {name!r} cannot be looked up ({error.problem})", f"give its address, or {error.remedy}"
        ) from None
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


async def _known_objects() -> dict[str, dict[str, dict[str, Any]]]:
    """Everything that the daemon knows, by path and interface."""
    async with _system_bus() as bus:
        asking = Message(destination=_BLUEZ, path="/", interface=f"{_BUS}.ObjectManager", member="GetManagedObjects")
        return dict((await _ask(bus, asking))[0])


@asynccontextmanager
async def _system_bus() -> "AsyncIterator[MessageBus]":
    """A connection to the system bus for the duration of a block."""
    if not _HAS_LIBRARY:
        raise UnavailableError("dbus-fast is not installed", "apt install python3-dbus-fast")
    with ExitStack() as ending:
        try:
            bus = MessageBus(bus_type=BusType.SYSTEM)  # Debian 12's version already connects here
            ending.callback(bus.disconnect)  # also if it is cancelled while connecting
            async with asyncio.timeout(_PATIENCE_S):
                await bus.connect()
        except (OSError, EOFError, AuthError, InvalidAddressError) as error:
            told = getattr(error, "strerror", None) or error
            raise UnavailableError(f"D-Bus does not answer ({told})", "systemctl start dbus") from None
        yield bus


async def _ask(bus: "MessageBus", question: "Message") -> list[Any]:
    """Call a method and return its answer.

    Raises:
        UnavailableError: it failed, or the bus is gone.
    """
    try:
        async with asyncio.timeout(_PATIENCE_S):
            answer = await bus.call(question)
    except (OSError, EOFError) as error:
        raise UnavailableError(f"D-Bus gave no answer to {question.member} ({error})", "systemctl start dbus") from None
    if answer is None:
        raise UnavailableError("D-Bus has stopped", "systemctl start dbus")
    if answer.message_type is MessageType.ERROR:
        told = answer.body[0] if answer.body else answer.error_name
        raise UnavailableError(f"bluetoothd refuses {question.member} ({told})", "systemctl restart bluetooth")
    return answer.body


def _of_bus(member: str, argument: str) -> "Message":
    return Message(
        destination=_BUS, path="/org/freedesktop/DBus", interface=_BUS, member=member, signature="s", body=[argument]
    )
