"""Viewers of the page for its benchmark: some that show every pair, and some that read 20 KB/s."""

import asyncio
import time
from dataclasses import dataclass, field
from typing import Final

import aiohttp

from phone_host.web.frames import taken_apart

SLOW_BYTES_PER_S: Final = 20_000
_WANT: Final = {"kind": "want", "views": ["left", "right", "disparity"], "width": 640, "hz": 10}
_STEP_S: Final = 0.1


@dataclass(slots=True)
class Seen:
    """What viewers got in one phase.

    Attributes:
        pairs: number of pairs, of all viewers.
        bytes: bytes of these.
        states: number of states.
    """

    pairs: int = 0
    bytes: int = 0
    states: int = 0
    ages_s: list[float] = field(default_factory=list)


async def look(url: str, seen: Seen, seconds: float) -> None:
    """Show every pair at once, as a quick page does.

    Args:
        url: of the page.
        seen: counts.
        seconds: for how long.
    """
    async with aiohttp.ClientSession() as client, client.ws_connect(f"{url}ws", max_msg_size=1 << 26) as socket:
        await socket.send_json(_WANT)
        end_s = time.monotonic() + seconds
        while (left_s := end_s - time.monotonic()) > 0:
            try:
                said = await socket.receive(left_s)
            except TimeoutError:
                return
            if said.type is aiohttp.WSMsgType.TEXT:
                seen.states += 1
            elif said.type is aiohttp.WSMsgType.BINARY:
                header, _ = taken_apart(said.data)
                seen.pairs += 1
                seen.bytes += len(said.data)
                await socket.send_json({"kind": "ack", "number": header["number"]})
            else:
                raise ConnectionError(str(said))


async def dawdle(host: str, port: int, seen: Seen, seconds: float) -> None:
    """Read 20 KB/s of everything that comes, and acknowledge nothing that has not come whole.

    Args:
        host: of the page.
        port: of the page.
        seen: counts the bytes.
        seconds: for how long.
    """
    reader, writer = await asyncio.open_connection(host, port, limit=4096)
    writer.write(
        f"GET /ws HTTP/1.1\r\nHost: {host}:{port}\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
        "Sec-WebSocket-Version: 13\r\nSec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n".encode()
    )
    text = str(_WANT).replace("'", '"').encode()
    # A client's frame is masked (RFC 6455, section 5.3); a mask of zeros leaves it readable. 126: two bytes of length follow.
    writer.write(bytes([0x81, 0x80 | 126]) + len(text).to_bytes(2, "big") + bytes(4) + text)
    end_s = time.monotonic() + seconds
    while time.monotonic() < end_s:
        seen.bytes += len(await asyncio.wait_for(reader.read(int(SLOW_BYTES_PER_S * _STEP_S)), seconds))
        await asyncio.sleep(_STEP_S)
    writer.close()
