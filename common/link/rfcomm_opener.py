"""Opens `rfcomm:` links: a byte stream over the kernel's own Bluetooth sockets, between two paired devices."""

from urllib.parse import unquote

from common.errors import SettingsError
from common.link.rfcomm_dialler import RfcommDialler
from common.link.rfcomm_listener import RfcommListener
from common.link.rfcomm_socket import ANYONE, is_address
from common.link.uri import LinkRequest


def open_rfcomm(request: LinkRequest) -> RfcommDialler | RfcommListener:
    """Open a Bluetooth link.

    Args:
        request: what to open; the address is `rfcomm://DEVICE[/CHANNEL]`.

    Raises:
        SettingsError: no device to dial was given, or the listening address is not an adapter's.
        UnavailableError: Bluetooth or the adapter cannot be had.
    """
    uri = request.uri
    device, _, number = uri.address.removeprefix("rfcomm://").partition("/")
    device, channel = unquote(device), int(number or 0)
    if not uri.listens:
        if device == ANYONE:
            raise SettingsError(f"link {uri.address!r} names no device to connect to", "give its name or address")
        return RfcommDialler(uri.address, device, channel, unpaired=uri.unpaired, waits=request.waits)
    if device != ANYONE and not is_address(device):
        raise SettingsError(f"link {uri.address!r} cannot be listened on", "give rfcomm://* or an adapter's address")
    return RfcommListener(uri.address, device, channel, unpaired=uri.unpaired, waits=request.waits)
