"""What an emulated interface does to bytes, in virtual time."""

import dataclasses
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError
from phone_host.bench.emulate import NOTHING, PROFILES, SEGMENT_BYTES, Profile, Way, parse_profiles

MS = 1_000_000
PLAIN = Profile(name="plain", carrier="tcp", bytes_per_s=1_000_000, delay_ns=3 * MS)


def drained(way: Way[str]) -> list[tuple[int, str, bytes]]:
    """All that is under way, with the arrival time of each piece."""
    came = []
    while way.due_ns < 2**63 - 1:
        now_ns = way.due_ns
        came += [(now_ns, key, data) for key, data in way.take(now_ns)]
    return came


@given(st.lists(st.tuples(st.sampled_from("ab"), st.binary(min_size=1, max_size=5000), st.integers(0, 10 * MS))))
def test_every_byte_arrives_once_and_in_order(puts: list[tuple[str, bytes, int]]) -> None:
    """Without byte loss each connection gets exactly its bytes in order, whatever jitter and stalls do."""
    profile = Profile(
        name="p",
        carrier="tcp",
        bytes_per_s=500_000,
        delay_ns=2 * MS,
        jitter_ns=5 * MS,
        stall_share=0.2,
        stall_ns=50 * MS,
    )
    way: Way[str] = Way(profile, 3)
    now_ns = 0
    for key, data, later_ns in puts:
        now_ns += later_ns
        way.put(key, data, now_ns)
    came = drained(way)
    for key in "ab":
        assert b"".join(d for _, k, d in came if k == key) == b"".join(d for k, d, _ in puts if k == key)
    assert [at for at, _, _ in came] == sorted(at for at, _, _ in came)


@given(st.integers(1, 60_000), st.integers(1, 60_000))
def test_bytes_arrive_after_delay_and_their_time_at_the_rate(first: int, second: int) -> None:
    """Two blocks handed over at once arrive bytes / rate + delay later, the second behind the first (to a rounding of 1 ns per piece)."""
    way: Way[str] = Way(PLAIN)
    way.put("a", bytes(first), 7)
    way.put("b", bytes(second), 7)
    came = drained(way)
    ends = [max(at for at, key, _ in came if key == name) for name in "ab"]
    assert ends[0] == pytest.approx(7 + 3 * MS + first * 1000, abs=1000)
    assert ends[1] == pytest.approx(7 + 3 * MS + (first + second) * 1000, abs=1000)


def test_an_idle_line_saves_nothing_up() -> None:
    """After a pause bytes still take their time at the rate, like a bucket without depth."""
    way: Way[str] = Way(PLAIN)
    way.put("a", bytes(1000), 0)
    drained(way)
    way.put("a", bytes(10_000), 10_000 * MS)
    assert drained(way)[-1][0] == pytest.approx(10_000 * MS + 13 * MS, abs=1000)


def test_jitter_is_spread_evenly_over_its_range() -> None:
    """Bytes sent alone arrive between delay and delay + jitter, about half of them in each half of that range."""
    way: Way[str] = Way(dataclasses.replace(PLAIN, jitter_ns=8 * MS), 1)
    late_ns = []
    for k in range(1000):
        way.put("a", b"x", k * 100 * MS)
        late_ns.append(drained(way)[0][0] - k * 100 * MS - 3 * MS - 1000)
    assert all(0 <= one <= 8 * MS for one in late_ns)
    assert 400 < sum(one < 4 * MS for one in late_ns) < 600


def test_a_lost_segment_holds_up_what_follows() -> None:
    """With every hundredth segment lost there are about that many stalls, each as long as stated, and nothing overtakes."""
    profile = dataclasses.replace(PLAIN, stall_share=0.01, stall_ns=200 * MS)
    way: Way[str] = Way(profile, 5)
    for k in range(2000):
        way.put("a", bytes(SEGMENT_BYTES), k * 2 * MS)
    came = [at for at, _, _ in drained(way)]
    # 2000 segments at 0.01: 20 expected, standard deviation 4.5 (binomial).
    assert 5 <= way.stalls <= 40
    assert max(b - a for a, b in pairwise(came)) > 100 * MS


def test_lost_bytes_are_as_many_as_said() -> None:
    """Of 10^6 bytes at 10^-4 each, about 100 vanish (binomial, standard deviation 10), and the account says how many."""
    way: Way[str] = Way(dataclasses.replace(PLAIN, byte_loss=1e-4), 9)
    way.put("a", bytes(1_000_000), 0)
    arrived = sum(len(data) for _, _, data in drained(way))
    assert arrived == 1_000_000 - way.lost_bytes
    assert 50 < way.lost_bytes < 150


def test_a_full_direction_has_no_room_until_something_arrived() -> None:
    """A direction holds at most its queue and what is under way: 5 ms + 3 ms at 1 MB/s here."""
    way: Way[str] = Way(PLAIN)
    assert way.room_bytes == 8000
    way.put("a", bytes(8000), 0)
    assert way.room_bytes == 0
    way.take(way.due_ns)
    assert 0 < way.room_bytes <= 8000


def test_the_end_of_a_stream_comes_behind_its_last_byte() -> None:
    """An empty piece marks the end of the stream and overtakes nothing."""
    for profile in (PLAIN, NOTHING):
        way: Way[str] = Way(profile)
        way.put("a", b"last", 0)
        way.put("a", b"", 0)
        assert [data for _, _, data in drained(way)] == [b"last", b""]


def test_profiles_are_found_by_name() -> None:
    """Names come out in order, each once; an unknown one is refused with a list of the known ones."""
    assert [profile.name for profile in parse_profiles("wifi, bluetooth,wifi")] == ["wifi", "bluetooth"]
    for text in ("", "pigeon", "wifi,", "WIFI"):
        with pytest.raises(SettingsError) as caught:
            parse_profiles(text)
        assert all(profile.name in caught.value.remedy for profile in PROFILES)


def test_profiles_are_sound() -> None:
    """Each says where its figures come from, is carried by a link that can be shaped, and only serial lines lose bytes."""
    for profile in PROFILES:
        assert profile.source
        assert profile.carrier in {"tcp", "serial"}
        assert profile.bytes_per_s > 0
        assert profile.byte_loss == 0 or profile.carrier == "serial"
        assert profile.held_bytes >= 2 * SEGMENT_BYTES


def test_a_line_without_a_rate_still_holds_no_more_than_a_pipe() -> None:
    """A line that adds no time holds 64 KiB, as a Linux pipe does (pipe(7)), and takes no more until these have been read."""
    way: Way[str] = Way(NOTHING)
    assert way.room_bytes == 65_536
    way.put("a", bytes(65_000), 5)
    assert way.room_bytes == 536
    assert way.take(5) == [("a", bytes(65_000))]
    assert way.room_bytes == 65_536
