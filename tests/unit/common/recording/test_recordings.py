"""What recordings are used for: as a camera, in figures, copied, and as folders."""

from pathlib import Path
from typing import Any

import cv2
import pytest

from common.camera.base import Ended
from common.camera.factory import open_camera
from common.errors import DataError, SettingsError, UnavailableError
from common.frame import Frame, PixelFormat
from common.ledger import BoardMarks, HostMarks, PairLedger, StageTimes, ledger_of
from common.protocol.message import Pacing
from common.recording.layout import camera_of, camera_values
from common.recording.mcap_records import Message
from common.recording.mcap_writer import McapWriter, Topic
from common.recording.opened import open_recorded
from common.recording.ros_messages import RecordedImage, image_message
from common.recording.stamps import pairs_of_two
from phone_host.recording.imports import ImportOptions, export_folders, import_folders, import_topics
from phone_host.recording.joining import copy_recording
from phone_host.recording.playback import open_playback
from phone_host.recording.session_info import session_info
from phone_host.recording.timed_images import TimeOptions
from tests.support.recorded import LATE_NS, PERIOD_NS, ZERO_NS, payload, recording_file


def _shown(camera: Any, count: int, now_ns: int = 0) -> list[Frame]:
    found: list[Frame] = []
    while len(found) < count:
        grabs = camera.read(now_ns)
        assert not any(isinstance(grab, Ended) for grab in grabs)
        found += [grab for grab in grabs if isinstance(grab, Frame)]
    return found


def test_images_of_one_moment_are_a_pair() -> None:
    """Each other's nearest within the limit, in order; one that is nearer to another's partner is alone, and so is one too far away."""
    assert pairs_of_two([0, 100, 200, 300], [10, 55, 110, 290, 420], 50) == [(0, 0), (1, 2), (3, 3)]
    assert pairs_of_two([0, 100], [], 50) == []
    assert pairs_of_two([], [1], 50) == []


def test_both_sides_show_the_images_of_one_moment_under_one_number(tmp_path: Path) -> None:
    """Two programs open the same file, each for one side; a missing image shifts nothing, and the bytes are those of then."""
    path = recording_file(tmp_path, 6, missing=frozenset({2}))
    left, right = (
        open_camera(f"replay:{path}?topic=/{side}/image/compressed", "here", 0) for side in ("left", "right")
    )
    assert left.description.pacing is Pacing.DEMAND
    assert left.numbers == right.numbers == (0, 1, 2, 3, 4)  # type: ignore[attr-defined]
    assert [bytes(frame.payload) for frame in _shown(right, 5)] == [payload(number) for number in (0, 1, 3, 4, 5)]
    frames = _shown(left, 5)
    assert [bytes(frame.payload) for frame in frames] == [payload(number) for number in (0, 1, 3, 4, 5)]
    assert (frames[0].width_px, frames[0].height_px) == (32, 24)
    assert isinstance(left.read(0)[0], Ended)


def test_with_pace_clock_the_images_come_at_their_times(tmp_path: Path) -> None:
    """As far apart as they were; each is exposed as long before it comes as it was then."""
    path = recording_file(tmp_path, 5)
    camera = open_camera(f"replay:{path}?topic=/left/image/compressed&pace=clock", "here", 1000)
    assert camera.due_ns(1000) == 1000 + 2_000_000
    assert camera.read(1000) == []
    frames = [frame for frame in camera.read(1000 + 2 * PERIOD_NS + 2_000_000) if isinstance(frame, Frame)]
    assert [frame.exposed.ns for frame in frames] == [1000, 1000 + PERIOD_NS, 1000 + 2 * PERIOD_NS]


def test_a_loop_of_both_sides_keeps_their_distance(tmp_path: Path) -> None:
    """Two programs started at different times show the same moment, lap after lap."""
    path = recording_file(tmp_path, 5)
    uris = [f"replay:{path}?topic=/{side}/image/compressed&pace=clock&loop=1" for side in ("left", "right")]
    left, right = (
        open_camera(uri, "here", start) for uri, start in zip(uris, (10**12, 10**12 + 77_000_000), strict=True)
    )
    now_ns = 10**12 + 900_000_000
    exposed = [{g.exposed.ns for g in camera.read(now_ns) if isinstance(g, Frame)} for camera in (left, right)]
    late = {min(abs(one - other) for one in exposed[0]) for other in exposed[1]}
    assert late == {LATE_NS}


@pytest.mark.parametrize(
    ("words", "problem"), [("", "several cameras"), ("?topic=/other", "has no images"), ("?fps=30", "fps")]
)
def test_a_camera_must_be_named(tmp_path: Path, words: str, problem: str) -> None:
    """One line that says which there are."""
    path = recording_file(tmp_path, 2)
    with pytest.raises((DataError, SettingsError), match=problem):
        open_camera(f"replay:{path}{words}", "here", 0)


@pytest.mark.parametrize(
    ("content", "problem"), [(b"", "empty"), (b"no recording at all", "no MCAP"), (None, "cannot be read")]
)
def test_other_files_are_refused_in_one_line(tmp_path: Path, content: bytes | None, problem: str) -> None:
    """Empty, of another kind, or missing."""
    path = tmp_path / "x.mcap"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(DataError, match=problem):
        open_recorded(path)


def test_a_recording_in_figures(tmp_path: Path) -> None:
    """25 images a second, the right ones 3 ms late, one missing on the left: a gap of two periods."""
    info = session_info(open_recorded(recording_file(tmp_path, 10, missing=frozenset({4}))))
    left, right = info.streams
    assert (left.images, right.images, left.rate_hz, left.transit_ms) == (9, 10, 25.0, 12.0)
    assert [(gap.at_s, gap.seconds, gap.missing) for gap in left.gaps] == [(0.12, 0.08, 1)]
    assert info.skew is not None
    assert info.skew.median_ms == -LATE_NS / 1e6
    assert (info.is_complete, info.is_ours, info.damages, info.attachments) == (True, True, (), (("rig.yaml", 250),))


def test_what_one_camera_saw_alone_is_no_skew(tmp_path: Path) -> None:
    """The right camera ends early: the left images behind have no neighbour."""
    path = tmp_path / "early.mcap"

    def wanted(message: Message) -> bool:
        return message.channel is not None and ("left" in message.channel.topic or message.sequence < 5)

    copy_recording(recording_file(tmp_path, 20), path, wanted)
    info = session_info(open_recorded(path))
    assert [stream.images for stream in info.streams] == [20, 5]
    assert info.skew is not None
    assert info.skew.far_ms == LATE_NS / 1e6


def test_what_is_told_of_a_camera_comes_back(tmp_path: Path) -> None:
    """Its size, period, mounting and identity; without any of it, what the images say."""
    camera = open_recorded(recording_file(tmp_path, 3)).camera("/left/image/compressed")
    assert (camera.width_px, camera.height_px, camera.period_ns) == (32, 24, PERIOD_NS)
    told = {**camera_values(camera), "orientation": "rotate=90&flip=h", "driver": "uvcvideo", "has_exact_stamps": "1"}
    back = camera_of(told, (1, 1), camera.pixel_format, 1)
    assert (str(back.orientation), back.identity.driver, back.has_exact_stamps) == (
        "rotate=90&flip=h",
        "uvcvideo",
        True,
    )
    assert (back.width_px, back.period_ns) == (32, PERIOD_NS)
    spoiled = camera_of({**told, "orientation": "rotate=91", "width_px": "-3"}, (1, 1), camera.pixel_format, 1)
    assert (str(spoiled.orientation), spoiled.width_px) == ("", 1)


def test_a_broken_recording_is_mended(tmp_path: Path) -> None:
    """What was whole in the broken file is a whole file then, with its metadata and attachments."""
    source = recording_file(tmp_path, 12)
    source.write_bytes(source.read_bytes()[:-8000])
    account = copy_recording(source, tmp_path / "whole.mcap")
    mended = open_recorded(tmp_path / "whole.mcap")
    assert mended.is_complete
    assert (mended.damages, mended.is_ours, list(mended.attachments)) == ([], True, ["rig.yaml"])
    assert account.messages == sum(mended.kinds.values()) > 0
    assert len(account.damages) == 1
    with pytest.raises(UnavailableError, match="exists already"):
        copy_recording(source, tmp_path / "whole.mcap")


def test_folders_hold_all_and_make_the_same_recording(tmp_path: Path) -> None:
    """Export and import: the same bytes at the same times; also from the folders alone with their times in a file."""
    source = open_recorded(recording_file(tmp_path, 4))
    assert export_folders(source, tmp_path / "out") == {"left": 4, "right": 4}
    assert (tmp_path / "out" / "rig.yaml").read_bytes() == b"a: 1\n" * 50
    import_folders([tmp_path / "out"], TimeOptions(), tmp_path / "again.mcap")
    sides = [tmp_path / "out" / side for side in ("left", "right")]
    for folder in sides:
        (folder / "data.csv").unlink()
    times = tmp_path / "times.txt"
    times.write_text("".join(f"{(ZERO_NS + number * PERIOD_NS) / 1e9:.9f}\n" for number in range(4)))
    import_folders(sides, TimeOptions(times), tmp_path / "timed.mcap")
    again, timed = (open_recorded(tmp_path / f"{name}.mcap") for name in ("again", "timed"))
    for topic, images in source.images.items():
        assert [bytes(one.image.payload) for one in again.images[topic]] == [bytes(one.image.payload) for one in images]
        assert [one.image.stamp_ns for one in again.images[topic]] == [one.image.stamp_ns for one in images]
    stamps = [one.image.stamp_ns for one in timed.images["/right/image/compressed"]]
    assert max(abs(stamp - ZERO_NS - number * PERIOD_NS) for number, stamp in enumerate(stamps)) < 1000
    times.write_text("1.0\n2.0\n")
    with pytest.raises(DataError, match="2 times"):
        import_folders(sides, TimeOptions(times), tmp_path / "no.mcap")


def test_two_topics_of_another_file(tmp_path: Path) -> None:
    """They may be exchanged; topics that are not there are named."""
    source = recording_file(tmp_path, 3)
    topics = ["/right/image/compressed", "/left/image/compressed"]
    assert import_topics(source, ImportOptions(topics), tmp_path / "two.mcap").images == {"left": 3, "right": 3}
    left = open_recorded(tmp_path / "two.mcap").images["/left/image/compressed"]
    assert left[0].image.stamp_ns == ZERO_NS + LATE_NS
    with pytest.raises(DataError, match="no two such"):
        import_topics(source, ImportOptions(["/left/image/compressed", "/x"]), tmp_path / "no.mcap")
    copy_recording(source, tmp_path / "one.mcap", lambda m: m.channel is not None and "left" in m.channel.topic)
    with pytest.raises(DataError, match="one camera only"):
        import_topics(tmp_path / "one.mcap", ImportOptions(), tmp_path / "no.mcap")


def test_a_replay_needs_both_cameras(tmp_path: Path) -> None:
    """And an address that says how it is to be played."""
    path = recording_file(tmp_path, 3)
    assert open_playback(f"{path}?pace=clock").pacing is Pacing.CLOCK
    with pytest.raises(SettingsError, match="not understood"):
        open_playback(f"{path}?pace=fast")
    copy_recording(path, tmp_path / "one.mcap", lambda m: m.channel is not None and "left" in m.channel.topic)
    with pytest.raises(DataError, match="one camera only"):
        open_playback(str(tmp_path / "one.mcap"))


def test_a_line_of_delays_comes_back() -> None:
    """Every mark, so that all delays are the same; another line is refused."""
    ledger = PairLedger(
        session="s",
        sequence=1,
        host_sequence=2,
        bytes=3,
        link="tcp",
        board=BoardMarks(exposed_ns=1, grabbed_ns=5, sent_ns=9),
        received_ns=20,
        paired_ns=25,
        queued_ns=26,
        dequeued_ns=30,
        done_ns=50,
        previous_done_ns=22,
        stages=StageTimes(match=7),
        time_skew_ns=-2,
        offset_ns=4,
        uncertainty_ns=1,
        host=HostMarks(exposed_ns=3, grabbed_ns=6),
    )
    assert ledger_of(ledger.to_json()) == ledger
    for text in ("", "{}", "[]", '{"stages_ns": 3}'):
        with pytest.raises(ValueError, match=r"delays|Expecting"):
            ledger_of(text)


def test_one_camera_is_described_alone(tmp_path: Path) -> None:
    """There is no skew, no number that pairs, and no side but its own; a single image has no rate."""
    path = recording_file(tmp_path, 1)
    copy_recording(path, tmp_path / "one.mcap", lambda m: m.channel is not None and "left" in m.channel.topic)
    found = open_recorded(tmp_path / "one.mcap")
    info = session_info(found)
    assert (info.skew, info.streams[0].rate_hz, found.topic_of("right")) == (None, 0.0, "")
    camera = open_camera(f"replay:{tmp_path / 'one.mcap'}", "here", 0)
    assert camera.numbers == ()  # type: ignore[attr-defined]
    assert len(_shown(camera, 1)) == 1


def _other(folder: Path, *messages: tuple[str, str, bytes]) -> Path:
    """A file of another program: topic, kind and content of each message; ROS 1 names, no metadata of ours."""
    data = bytearray()
    kinds = dict.fromkeys((topic, kind) for topic, kind, _ in messages)
    channels = tuple(Topic(topic, "cdr" if kind else "json", kind, "ros2msg") for topic, kind in kinds)
    writer = McapWriter(data.extend, "another", channels)
    for number, (topic, _, content) in enumerate(messages):
        writer.add(topic, content, sequence=number, log_ns=number * PERIOD_NS, publish_ns=0)
    writer.finish()
    path = folder / "other.mcap"
    path.write_bytes(data)
    return path


def test_files_of_other_programs_are_read(tmp_path: Path) -> None:
    """By the names of their topics, else in their order; raw images tell their size; what is no image is counted as missing."""
    raw = RecordedImage(7, "cam", PixelFormat.GREY, (4, 2), bytes(8))
    image, kind = image_message(raw), "sensor_msgs/Image"
    path = _other(
        tmp_path,
        ("/cam1/raw", kind, image),
        ("/cam0/raw", kind, image),
        ("/cam0/raw", kind, b"\0\1\0\0"),
        ("/say", "", b"{"),
    )
    found = open_recorded(path)
    assert (found.is_ours, found.topic_of("left"), found.topic_of("right")) == (False, "/cam0/raw", "/cam1/raw")
    assert (found.camera("/cam0/raw").width_px, found.camera("/cam0/raw").pixel_format) == (4, PixelFormat.GREY)
    assert [damage.text for damage in found.damages] == ["1 message is of an unknown topic or spoiled"]
    named = open_recorded(_other(tmp_path, ("/a/right", kind, image), ("/z/left", kind, image)))
    assert (named.topic_of("left"), named.topic_of("right")) == ("/z/left", "/a/right")
    with pytest.raises(DataError, match="holds no images"):
        open_recorded(
            _other(tmp_path, ("/say", "", b"{}"), ("/board_capture", "", b"nonsense"), ("/board_capture", "", b"[[1]]"))
        )


def test_raw_images_become_png_files(tmp_path: Path) -> None:
    """A format without a file of its own is decoded."""
    raw = image_message(RecordedImage(PERIOD_NS, "left", PixelFormat.GREY, (4, 2), bytes(range(8))))
    path = _other(
        tmp_path, ("/left/image", "sensor_msgs/msg/Image", raw), ("/right/image", "sensor_msgs/msg/Image", raw)
    )
    export_folders(open_recorded(path), tmp_path / "raw")
    written = cv2.imread(str(tmp_path / "raw" / "left" / f"{PERIOD_NS}.png"), cv2.IMREAD_GRAYSCALE)
    assert written is not None
    assert written.ravel().tolist() == list(range(8))
