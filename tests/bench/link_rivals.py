"""imagezmq and vidgear NetGear as transports of the link benchmark, used as their documentation shows."""

import time
from typing import Any

import imagezmq
import numpy as np
import zmq
from vidgear.gears import NetGear

from tests.bench.link_job import SILENCE_S, Job, Tally, pace

_STAMP_BYTES = 16
_SUBSCRIBE_S = 1.0
"""A PUB socket drops what it sends before the subscription arrives."""


def send_imagezmq(job: Job) -> Tally:
    """Rival imagezmq: REQ/REP; the sender waits for each reply."""
    sender = imagezmq.ImageSender(connect_to=job.address)
    return pace(job, lambda number, payload: sender.send_jpg(f"{number} {time.monotonic_ns()}", payload))


def receive_imagezmq(job: Job) -> Tally:
    """Rival imagezmq: hub with replies."""
    return _receive_imagezmq(job, imagezmq.ImageHub(open_port=job.address), replies=True)


def send_imagezmq_pub(job: Job) -> Tally:
    """Rival imagezmq: PUB/SUB; nothing waits, and losses go unreported."""
    sender = imagezmq.ImageSender(connect_to=f"tcp://*:{job.endpoint[1]}", REQ_REP=False)
    time.sleep(_SUBSCRIBE_S)
    return pace(job, lambda number, payload: sender.send_jpg(f"{number} {time.monotonic_ns()}", payload))


def receive_imagezmq_sub(job: Job) -> Tally:
    """Rival imagezmq: hub that subscribes."""
    return _receive_imagezmq(job, imagezmq.ImageHub(open_port=job.address, REQ_REP=False), replies=False)


def _receive_imagezmq(job: Job, hub: Any, *, replies: bool) -> Tally:
    tally = job.tally()
    hub.zmq_socket.setsockopt(zmq.RCVTIMEO, round((SILENCE_S + _SUBSCRIBE_S) * 1000))
    number = -1
    while number < job.frames - 1:
        try:
            text, payload = hub.recv_jpg()
        except zmq.Again:
            break
        number, sent_ns = (int(part) for part in text.split())
        tally.arrived(number, sent_ns, len(payload))
        if replies:
            hub.send_reply()
    return tally


def _netgear(job: Job, *, receives: bool) -> Any:
    """NetGear with its default pattern, PAIR; without compression, which would encode the JPEG again."""
    host, port = job.endpoint
    options: dict[str, Any] = {"jpeg_compression": False}
    return NetGear(address=host, port=str(port), protocol="tcp", pattern=0, receive_mode=receives, **options)


def send_netgear(job: Job) -> Tally:
    """Rival NetGear: it carries arrays but no text, so number and stamp are written in place as the array's last bytes."""
    server = _netgear(job, receives=False)
    arrays: dict[int, np.ndarray[Any, np.dtype[np.uint8]]] = {}

    def send(number: int, payload: bytes) -> None:
        array = arrays.get(id(payload))
        if array is None:
            array = arrays[id(payload)] = np.frombuffer(payload + bytes(_STAMP_BYTES), np.uint8).copy()
        array[-_STAMP_BYTES:].view(np.int64)[:] = number, time.monotonic_ns()
        server.send(array)

    tally = pace(job, send)
    server.close()
    return tally


def receive_netgear(job: Job) -> Tally:
    """Rival NetGear: its receiving thread and queue."""
    client, tally = _netgear(job, receives=True), job.tally()
    number = -1
    while number < job.frames - 1 and (array := client.recv()) is not None:
        number, sent_ns = np.frombuffer(array[-_STAMP_BYTES:].tobytes(), np.int64).tolist()
        tally.arrived(number, sent_ns, len(array) - _STAMP_BYTES)
    return tally  # its thread ends with the process: close() would close the socket while the thread uses it
