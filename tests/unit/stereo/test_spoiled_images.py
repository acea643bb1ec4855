"""Images whose bytes are complete but wrong: the decoder's message is caught and counted, and does not reach stderr."""

import ctypes
import subprocess
import sys
import threading

import cv2
import numpy as np
import pytest

from common.frame import FrameFault, SpoiledImageError
from phone_host.stereo.images import decode, decode_files, examine
from phone_host.stereo.overheard import overhear
from tests.support import bombs
from tests.support.decoder_watch import watched_decoder
from tests.support.pictures import encoded, jpeg, picture

SOUND = bombs.textured_jpeg()
WITH_RESTARTS = bombs.textured_jpeg(restart=4)


def cut(content: bytes) -> bytes:
    """Half of a JPEG, closed with an end marker, as a careless program writes it."""
    return content[: len(content) // 2] + b"\xff\xd9"


def flipped(content: bytes, bits: int = 40) -> bytes:
    """A JPEG with some bits of its compressed data flipped, as by faulty memory or a faulty cable; no byte becomes a marker."""
    data, chance = bytearray(content), np.random.default_rng(3)
    start = bombs.scan_start(content)
    while bits:
        at = int(chance.integers(start, len(data) - 2))
        changed = data[at] ^ 1 << int(chance.integers(8))
        if 0xFF not in {data[at - 1], data[at], changed}:
            data[at] = changed
            bits -= 1
    return bytes(data)


def without_a_restart(content: bytes) -> bytes:
    """A JPEG without the bytes from its restart marker FF D2 up to FF D4."""
    start = content.index(b"\xff\xd2")
    return content[:start] + content[content.index(b"\xff\xd4") :]


SPOILED = {
    "cut and closed": cut(SOUND),
    "cut and closed, with restart markers": cut(WITH_RESTARTS),
    "bits flipped": flipped(SOUND),
    "a restart marker lost": without_a_restart(WITH_RESTARTS),
    "a progressive one cut and closed": cut(bombs.progressive(640, 480)),
}


@pytest.mark.parametrize("case", SPOILED)
def test_a_corrupt_body_is_told(case: str, capfd: pytest.CaptureFixture[str]) -> None:
    """A JPEG whose data run out, make no sense or skip a restart marker is refused by name as corrupt; nothing is printed."""
    with pytest.raises(SpoiledImageError, match="frame 7") as caught:
        decode(SPOILED[case], "frame 7")
    assert caught.value.fault is FrameFault.CORRUPT
    assert capfd.readouterr().err == ""


def test_sound_images_pass_unchanged(capfd: pytest.CaptureFixture[str]) -> None:
    """Sound JPEGs, with restart markers or progressive, give the same pixels as OpenCV, before and after a spoiled one."""
    for content in (SOUND, WITH_RESTARTS, bombs.progressive(), jpeg()):
        expected = cv2.imdecode(np.frombuffer(content, np.uint8), cv2.IMREAD_UNCHANGED)
        assert expected is not None
        np.testing.assert_array_equal(decode(content), expected)
        with pytest.raises(SpoiledImageError):
            decode(SPOILED["cut and closed"])
        np.testing.assert_array_equal(decode(content), expected)
    assert capfd.readouterr().err == ""


@pytest.mark.parametrize("junk", [b"\0", b"\0\0", b"abcd"])
def test_what_webcams_leave_before_the_end_is_harmless(junk: bytes, capfd: pytest.CaptureFixture[str]) -> None:
    """A few bytes between the data and the end marker, and any number between segments, change no pixel: the image is accepted."""
    sloppy = SOUND[:-2] + junk + SOUND[-2:]
    np.testing.assert_array_equal(decode(sloppy), decode(SOUND))
    untidy = SOUND[:20] + bytes(300) + SOUND[20:]
    np.testing.assert_array_equal(decode(untidy), decode(SOUND))
    assert capfd.readouterr().err == ""


def test_a_decoder_that_is_left_with_much_has_lost_its_way() -> None:
    """Hundreds of bytes between the data and the end marker are not padding."""
    with pytest.raises(SpoiledImageError, match="extraneous"):
        decode(SOUND[:-2] + SOUND[-400:])


def test_words_of_other_decoders_are_not_printed(capfd: pytest.CaptureFixture[str]) -> None:
    """Spoiled images of every kind are refused without output on stderr, OpenCV's own log included."""
    for suffix in (".png", ".webp", ".tiff", ".bmp"):
        content = bytearray(encoded(suffix, picture(64, 48)))
        content[len(content) // 2 :] = bytes(len(content) - len(content) // 2)
        for bad in (bytes(content), bytes(content[: len(content) // 2])):
            try:
                decode(bad)
            except SpoiledImageError:
                continue
    assert capfd.readouterr().err == ""


def test_both_images_of_a_pair_are_heard() -> None:
    """The spoiled one is named."""
    with pytest.raises(SpoiledImageError, match="the right one"):
        decode_files(examine(SOUND, "the left one"), examine(SPOILED["bits flipped"], "the right one"))


def test_threads_do_not_hear_each_other() -> None:
    """While one thread decodes spoiled images, another thread's sound images are never blamed, and each spoiled one is reported."""
    wrong: list[str] = []

    def check(content: bytes, is_sound: bool) -> None:  # noqa: FBT001 - what the thread is told
        for _ in range(60):
            try:
                decode(content)
                found = True
            except SpoiledImageError:
                found = False
            if found is not is_sound:
                wrong.append(f"sound: {is_sound}")

    threads = [threading.Thread(target=check, args=(SPOILED["cut and closed"], False)) for _ in range(2)]
    threads += [threading.Thread(target=check, args=(SOUND, True)) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert wrong == []


def test_stderr_stays_what_it_is(capfd: pytest.CaptureFixture[str]) -> None:
    """Python's stderr, and that of children started meanwhile, are not affected. The C library's is the usual one afterwards, even after an error."""
    c_library = ctypes.CDLL(None)
    stream = ctypes.c_void_p.in_dll(c_library, "stderr")
    usual = stream.value

    def talk() -> None:
        print("from Python", file=sys.stderr, flush=True)
        subprocess.run(["sh", "-c", "echo from a child >&2"], check=True)
        c_library.fprintf(stream, b"from C\n")

    assert overhear(talk) == "from C\n"
    assert capfd.readouterr().err == "from Python\nfrom a child\n"
    assert overhear(lambda: None) == ""
    with pytest.raises(ZeroDivisionError):
        overhear(lambda: 1 / 0)
    assert stream.value == usual
    c_library.fprintf(stream, b"from C again\n")
    assert capfd.readouterr().err == "from C again\n"


def test_words_of_other_libraries_are_logged(caplog: pytest.LogCaptureFixture) -> None:
    """What another library prints while an image is decoded becomes a line in the log."""
    c_library = ctypes.CDLL(None)
    stream = ctypes.c_void_p.in_dll(c_library, "stderr")
    with watched_decoder(lambda: c_library.fprintf(stream, b"the radio is on fire\n")):
        decode(SOUND)
    assert "library_said text='the radio is on fire'" in caplog.text
