"""An MJPEG server with a choice of behaviours: `python -m tests.support.mjpeg_server FOLDER FPS MANNER PORT [CERTIFICATE]`.

Most of the behaviours are bad. The server runs in its own process and prints its port. At time k / FPS of
CLOCK_MONOTONIC it sends image k (modulo their number), as a replay shows it. A manner that goes wrong after some images
does so on the first connection; later connections are sound, so that a client that comes back can be tested.
"""

import base64
import json
import random
import socket
import ssl
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import Final

from common.camera.replay import find_images
from tests.support.bombs import claiming, jpeg_bomb

USER: Final = "me"
PASSWORD: Final = "a:b@c/%"
_GOOD_IMAGES: Final = 20
"""This many images are sent before a manner goes wrong."""

_BOMBS: Final = range(100, 110)
"""Late enough for a client that first learns what is normal."""

_TYPE: Final = "multipart/x-mixed-replace"
_LONG_S: Final = 600


class Exchange:
    """One connection, after its request."""

    def __init__(self, sock: socket.socket, request: str, number: int, images: list[bytes], fps: float) -> None:
        self.sock, self.request, self.number = sock, request, number
        self._images, self._fps = images, fps

    def say(self, text: str, data: bytes = b"") -> None:
        """Write a text with its line ends, followed by bytes."""
        self.sock.sendall(text.replace("\n", "\r\n").encode() + data)

    def answer(self, kind: str, more: str = "") -> None:
        """Begin a stream."""
        self.say(f"HTTP/1.1 200 OK\nServer: test\nContent-Type: {kind}\n{more}\n")

    def film(self) -> Iterator[bytes]:
        """Images at their times, without end."""
        index = int(time.monotonic() * self._fps) + 1
        while True:
            time.sleep(max(0.0, index / self._fps - time.monotonic()))
            yield self._images[index % len(self._images)]
            index = max(index + 1, int(time.monotonic() * self._fps))

    def parts(self, boundary: str = "--frame") -> None:
        """Valid parts, without end."""
        for image in self.film():
            self.part(image, boundary)

    def part(self, image: bytes, boundary: str = "--frame") -> None:
        """One valid part."""
        self.say(f"{boundary}\nContent-Type: image/jpeg\nContent-Length: {len(image)}\n\n", image + b"\r\n")

    def is_sound(self, sent: int) -> bool:
        """Whether to behave well: not enough images sent yet, or a later connection than the first.

        Args:
            sent: images of this connection so far.
        """
        return self.number > 1 or sent < _GOOD_IMAGES

    def first_parts(self) -> Iterator[bytes]:
        """Valid parts until it is time to go wrong, then the images that follow. On later connections: valid parts without end."""
        self.answer(f"{_TYPE}; boundary=frame")
        film = self.film()
        for sent, image in enumerate(film):
            if self.is_sound(sent):
                self.part(image)
            else:
                yield image


def plain(on: Exchange) -> None:
    """As RFC 2046 has it."""
    on.answer(f"{_TYPE}; boundary=frame")
    on.parts()


def dashes(on: Exchange) -> None:
    """The announcement already contains the dashes, quoted, beside another parameter."""
    on.answer(f'{_TYPE};charset=utf-8; boundary="--dcmjpeg"')
    on.parts("--dcmjpeg")


def no_dashes(on: Exchange) -> None:
    """The boundary is sent exactly as announced, without dashes; no lengths."""
    on.answer(f"{_TYPE}; boundary=Ba4oTvQMY8ew04N8dcnM")
    for image in on.film():
        on.say("Ba4oTvQMY8ew04N8dcnM\nContent-Type: image/jpeg\n\n", image + b"\r\n")


def no_line_end(on: Exchange) -> None:
    """Nothing between an image and the next boundary; no lengths; HTTP/1.0."""
    on.say(f"HTTP/1.0 200 OK\nContent-type: {_TYPE};boundary=x\n\n")
    for image in on.film():
        on.say("--x\nContent-type: image/jpg\nX-Timestamp: 12\n\n", image)


def wrong_boundary(on: Exchange) -> None:
    """One boundary announced, another sent, and false lengths."""
    on.answer(f"{_TYPE}; boundary=announced")
    for image in on.film():
        on.say("--written\nContent-Length: 10\n\n", image + b"\r\n")


def chunked(on: Exchange) -> None:
    """Chunked transfer encoding; chunks end anywhere."""
    on.answer(f"{_TYPE}; boundary=frame", "Transfer-Encoding: chunked\n")
    for image in on.film():
        part = b"--frame\r\nContent-Type: image/jpeg\r\n\r\n" + image + b"\r\n"
        for at in range(0, len(part), 700):
            piece = part[at : at + 700]
            on.sock.sendall(b"%x\r\n%s\r\n" % (len(piece), piece))


def empty_parts(on: Exchange) -> None:
    """An empty part before every image, to keep the line alive."""
    on.answer(f"{_TYPE}; boundary=frame")
    for image in on.film():
        on.say("--frame\nContent-Type: image/jpeg\nContent-Length: 0\n\n\n")
        on.part(image)


def early_boundary(on: Exchange) -> None:
    """The next part's header comes together with the image before it."""
    on.answer(f"{_TYPE}; boundary=frame")
    header = "--frame\nContent-Type: image/jpeg\n\n"
    on.say(header)
    for image in on.film():
        on.sock.sendall(image + b"\r\n" + header.replace("\n", "\r\n").encode())


def garbage(on: Exchange) -> None:
    """Random bytes between the parts."""
    chance = random.Random(1)
    on.answer(f"{_TYPE}; boundary=frame")
    for image in on.film():
        on.sock.sendall(chance.randbytes(chance.randrange(300)).replace(b"\xff", b"\0"))
        on.part(image)


def truncated(on: Exchange) -> None:
    """Every fourth image is cut in half, as its length says."""
    on.answer(f"{_TYPE}; boundary=frame")
    for count, image in enumerate(on.film()):
        on.part(image[: len(image) // 2] if count % 4 == 3 else image)


def no_end(on: Exchange) -> None:
    """Every image lacks its end marker."""
    on.answer(f"{_TYPE}; boundary=frame")
    for image in on.film():
        on.part(image[:-2])


def sizeless(on: Exchange) -> None:
    """Every image claims to have no pixels."""
    on.answer(f"{_TYPE}; boundary=frame")
    for image in on.film():
        on.part(claiming(image, 0, 0))


def bombs(on: Exchange) -> None:
    """After a while every image claims 8000x8000."""
    on.answer(f"{_TYPE}; boundary=frame")
    for sent, image in enumerate(on.film()):
        on.part(image if sent < _GOOD_IMAGES else claiming(image, 8000, 8000))


def turning(on: Exchange) -> None:
    """After a while every other image claims to be upright."""
    on.answer(f"{_TYPE}; boundary=frame")
    for sent, image in enumerate(on.film()):
        on.part(image if sent < _GOOD_IMAGES or sent % 2 else claiming(image, 120, 160))


def password(on: Exchange) -> None:
    """Basic authentication."""
    secret = base64.b64encode(f"{USER}:{PASSWORD}".encode()).decode()
    if f"authorization: basic {secret.lower()}" not in on.request.lower():
        on.say('HTTP/1.1 401 Unauthorized\nWWW-Authenticate: Basic realm="cam"\nContent-Length: 0\n\n')
        return
    plain(on)


def digest(on: Exchange) -> None:
    """A different kind of password."""
    on.say('HTTP/1.1 401 Unauthorized\nWWW-Authenticate: Digest realm="cam", nonce="1"\nContent-Length: 0\n\n')


def page(on: Exchange) -> None:
    """A web page."""
    on.answer("text/html; charset=utf-8", "Content-Length: 13\n")
    on.say("<html></html>")


def snapshot(on: Exchange) -> None:
    """One image."""
    image = next(on.film())
    on.answer("image/jpeg", f"Content-Length: {len(image)}\n")
    on.sock.sendall(image)


def missing(on: Exchange) -> None:
    """Not found."""
    on.say("HTTP/1.1 404 Not Found\nContent-Length: 0\n\n")


def moved(on: Exchange) -> None:
    """Redirects elsewhere."""
    on.say("HTTP/1.1 302 Found\nLocation: http://elsewhere/video\nContent-Length: 0\n\n")


def moved_here(on: Exchange) -> None:
    """Redirects to the same server, permanently."""
    on.say("HTTP/1.1 301 Moved Permanently\nLocation: /other\nContent-Length: 0\n\n")


def busy(on: Exchange) -> None:
    """Another client has the camera."""
    on.say("HTTP/1.1 503 Service Unavailable\nContent-Length: 0\n\n")


def another_tongue(on: Exchange) -> None:
    """Not HTTP."""
    on.say("SSH-2.0-OpenSSH_9.2\n")


def no_image(on: Exchange) -> None:
    """Parts that are no images."""
    on.answer(f"{_TYPE}; boundary=frame")
    for _ in on.film():
        on.part(b"this is no image")


def mute(on: Exchange) -> None:
    """Never answers."""
    del on
    time.sleep(_LONG_S)


def drips_head(on: Exchange) -> None:
    """Answers one letter at a time and never finishes."""
    for letter in "HTTP/1.1 200 OK\r\nX-Long: " + 10_000 * "x":
        on.sock.sendall(letter.encode())
        time.sleep(0.2)


def hangs(on: Exchange) -> None:
    """Goes silent in the middle of an image."""
    for image in on.first_parts():
        on.say("--frame\n\n", image[:100])
        time.sleep(_LONG_S)


def closes(on: Exchange) -> None:
    """Hangs up in the middle of an image."""
    for image in on.first_parts():
        on.say("--frame\n\n", image[:100])
        return


def resets(on: Exchange) -> None:
    """Breaks the connection (SO_LINGER of 0: a reset instead of an orderly end)."""
    for _ in on.first_parts():
        on.sock.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        return


def bad_chunks(on: Exchange) -> None:
    """Chunks whose sizes stop being numbers."""
    on.answer(f"{_TYPE}; boundary=frame", "Transfer-Encoding: chunked\n")
    for sent, image in enumerate(on.film()):
        part = b"--frame\r\n\r\n" + image
        size = b"%x" % len(part) if on.is_sound(sent) else b"none"
        on.sock.sendall(size + b"\r\n" + part + b"\r\n")


def last_chunk(on: Exchange) -> None:
    """A chunked answer that ends properly, like a server that restarts its camera."""
    on.answer(f"{_TYPE}; boundary=frame", "Transfer-Encoding: chunked\n")
    for sent, image in enumerate(on.film()):
        if not on.is_sound(sent):
            on.sock.sendall(b"0\r\n\r\n")
            return
        on.sock.sendall(b"%x\r\n%s\r\n" % (len(image), image))


def drips(on: Exchange) -> None:
    """Continues with a byte now and then, each within every timeout."""
    for image in on.first_parts():
        for at in range(len(image)):
            on.sock.sendall(image[at : at + 1])
            time.sleep(0.2)


def endless(on: Exchange) -> None:
    """An image that never ends."""
    for image in on.first_parts():
        on.say("--frame\n\n", image[: len(image) // 2])
        while True:
            on.sock.sendall(bytes(1 << 18))


def bomb_burst(on: Exchange) -> None:
    """Ten small images that claim to be huge, then sound ones again."""
    for count, image in enumerate(on.first_parts()):
        on.part(jpeg_bomb() if count in _BOMBS else image)


MANNERS: Final[dict[str, Callable[[Exchange], None]]] = {
    manner.__name__: manner
    for manner in (
        plain, dashes, no_dashes, no_line_end, wrong_boundary, chunked, early_boundary, empty_parts, garbage, truncated, no_end, sizeless, bombs, turning, password, digest, page,
        snapshot, missing, moved, moved_here, busy, another_tongue, no_image, mute, drips_head, hangs, closes, resets, bad_chunks, last_chunk, drips, endless, bomb_burst,
    )
}  # fmt: skip


class MjpegServer:
    """The server as a child process.

    Args:
        folder: its images.
        fps: images a second.
        manner: one of MANNERS.
        certificate: a file with certificate and key, for https.
        port: 0: a free one.
    """

    def __init__(
        self, folder: Path, fps: float = 20, manner: str = "plain", certificate: Path | None = None, port: int = 0
    ) -> None:
        arguments = [str(folder), str(fps), manner, str(port), *([str(certificate)] if certificate else [])]
        self._process = subprocess.Popen(
            [sys.executable, "-m", "tests.support.mjpeg_server", *arguments], stdout=subprocess.PIPE
        )
        assert self._process.stdout is not None
        self.port = int(json.loads(self._process.stdout.readline()))
        self.uri = f"http{'s' if certificate else ''}://127.0.0.1:{self.port}/video"

    def stop(self) -> None:
        """End it."""
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()


def main(arguments: list[str]) -> None:
    """Serve."""
    folder, fps, manner, port, *certificate = arguments
    images = [path.read_bytes() for path in find_images(folder)]
    with socket.create_server(("127.0.0.1", int(port))) as server:
        context = None
        if certificate:
            context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
            context.load_cert_chain(certificate[0])
        print(json.dumps(server.getsockname()[1]), flush=True)
        number = 0
        while True:
            sock, _ = server.accept()
            number += 1
            begin = partial(_begin, manner, number, images, float(fps))
            answering = partial(_answer, sock, context, begin)
            threading.Thread(target=answering, daemon=True).start()


def _begin(manner: str, number: int, images: list[bytes], fps: float, stream: socket.socket, request: str) -> None:  # noqa: PLR0917 - bound one after the other
    MANNERS[manner](Exchange(stream, request, number, images, fps))


def _answer(sock: socket.socket, context: ssl.SSLContext | None, answer: Callable[[socket.socket, str], None]) -> None:
    with suppress(OSError):  # the client has gone, or rejected the certificate
        stream = context.wrap_socket(sock, server_side=True) if context else sock
        with stream:
            stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            request = b""
            while b"\r\n\r\n" not in request and (data := stream.recv(4096)):
                request += data
                if not request[:1].isalpha():
                    return  # not HTTP
            answer(stream, request.decode("latin-1"))


if __name__ == "__main__":
    main(sys.argv[1:])
