"""Runs in the guest: pairs one of its two Bluetooth adapters with the other through bluetoothd, as two people with two machines would.

pair.py OWN_ADDRESS OTHER_ADDRESS

Plays both people: looks for the other adapter, asks for pairing, confirms every question, trusts. Uses Debian's python3-dbus-fast.
"""

import asyncio
import sys
from typing import Any

from dbus_fast import BusType, Message, MessageType, Variant
from dbus_fast.aio import MessageBus

_BLUEZ, _AGENT = "org.bluez", "/people"
_PROPERTIES = "org.freedesktop.DBus.Properties"
_YES = Variant("b", True)  # noqa: FBT003 - a value of D-Bus


async def ask(bus: MessageBus, path: str, interface: str, member: str, signature: str = "", *body: Any) -> Any:
    """Call a method of the daemon; return its answer."""
    call = Message(
        destination=_BLUEZ, path=path, interface=interface, member=member, signature=signature, body=list(body)
    )
    answer = await bus.call(call)
    assert answer is not None
    assert answer.message_type is not MessageType.ERROR, f"{member} of {path}: {answer.error_name} {answer.body}"
    return answer.body[0] if answer.body else None


async def found(bus: MessageBus, wanted: str, address: str, below: str = "") -> str:
    """Wait until the daemon knows an adapter or a device with this address; return its path."""
    while True:
        objects = await ask(bus, "/", "org.freedesktop.DBus.ObjectManager", "GetManagedObjects")
        for path, interfaces in objects.items():
            if wanted in interfaces and interfaces[wanted]["Address"].value == address and path.startswith(below):
                return str(path)
        await asyncio.sleep(0.2)


async def main(own: str, other: str) -> None:
    """Pair and trust, in both directions."""
    bus = await MessageBus(bus_type=BusType.SYSTEM).connect()

    def asked(message: Message) -> Message | None:
        if message.message_type is not MessageType.METHOD_CALL or message.path != _AGENT:
            return None
        return Message.new_method_return(message)

    bus.add_message_handler(asked)
    await ask(bus, "/org/bluez", "org.bluez.AgentManager1", "RegisterAgent", "os", _AGENT, "DisplayYesNo")
    await ask(bus, "/org/bluez", "org.bluez.AgentManager1", "RequestDefaultAgent", "o", _AGENT)
    adapters = {address: await found(bus, "org.bluez.Adapter1", address) for address in (own, other)}
    for adapter in adapters.values():
        for name in ("Powered", "Pairable", "Discoverable"):
            await ask(bus, adapter, _PROPERTIES, "Set", "ssv", "org.bluez.Adapter1", name, _YES)
    await ask(bus, adapters[own], "org.bluez.Adapter1", "StartDiscovery")
    device = await found(bus, "org.bluez.Device1", other, adapters[own])
    # Pair first: the end of a search makes the daemon forget devices that it has only seen, not yet connected.
    await ask(bus, device, "org.bluez.Device1", "Pair")
    await ask(bus, adapters[own], "org.bluez.Adapter1", "StopDiscovery")
    for path in (device, await found(bus, "org.bluez.Device1", own, adapters[other])):
        await ask(bus, path, _PROPERTIES, "Set", "ssv", "org.bluez.Device1", "Trusted", _YES)


asyncio.run(main(*sys.argv[1:]))
