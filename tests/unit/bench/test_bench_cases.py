"""What the delay benchmark is asked for: links, sizes, rates, qualities and profiles, and the cases they make."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from common.errors import SettingsError
from phone_host.bench.cases import (
    LOCAL_LINKS,
    SHAPED_LINKS,
    Interface,
    Size,
    cases,
    interfaces,
    parse_links,
    parse_qualities,
    parse_rates,
    parse_sizes,
)
from phone_host.bench.emulate import PROFILES
from phone_host.bench.runs import rig_of


@given(st.lists(st.sampled_from(LOCAL_LINKS), min_size=1))
def test_links_are_each_measured_once(names: list[str]) -> None:
    """Links come out in the order in which they were first named, each once."""
    assert parse_links(" , ".join(names)) == tuple(dict.fromkeys(names))


@pytest.mark.parametrize("text", ["usb", "tcp,foo", "", ",", "TCP"])
def test_a_link_that_is_not_there_is_refused_with_those_that_are(text: str) -> None:
    """The message of the refusal lists every link that can be measured."""
    with pytest.raises(SettingsError) as caught:
        parse_links(text)
    assert all(name in caught.value.remedy for name in LOCAL_LINKS)


@given(st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    """Any text for sizes, rates or links gives values or one SettingsError, nothing else."""
    for parse in (parse_sizes, parse_rates, parse_qualities, parse_links):
        try:
            assert parse(text)
        except SettingsError as error:
            assert "\n" not in error.remedy  # noqa: PT017 - any text is allowed to be refused


@pytest.mark.parametrize(
    "text", ["640", "640x", "x480", "0x0", "640x480x3", "-640x480", "63x480", "99999x9", "\u0666\u0664\u0660x480"]
)
def test_a_size_of_no_use_is_refused(text: str) -> None:
    """Sizes are WIDTHxHEIGHT in plain digits, within the limits."""
    with pytest.raises(SettingsError):
        parse_sizes(text)


@pytest.mark.parametrize("text", ["0", "-1", "29.97", "241", "a", ""])
def test_a_rate_of_no_use_is_refused(text: str) -> None:
    """Rates are whole numbers from 1 to 240."""
    with pytest.raises(SettingsError):
        parse_rates(text)


@pytest.mark.parametrize("text", ["0", "101", "80.5", "-1", "best", "", ","])
def test_a_quality_of_no_use_is_refused(text: str) -> None:
    """JPEG qualities are whole numbers from 1 to 100."""
    with pytest.raises(SettingsError):
        parse_qualities(text)


@pytest.mark.parametrize("text", ["tcp://", "tcp://192.168.7.2", "pigeon:5555", "serial:"])
def test_a_uri_of_no_link_is_refused(text: str) -> None:
    """A name with a colon is a board's address and is checked as one."""
    with pytest.raises(SettingsError):
        parse_links(text)


def test_every_profile_is_carried_by_its_own_link_or_the_named_ones() -> None:
    """Without named links each profile uses its own carrier; with them every link stands in for every profile; without profiles links are themselves."""
    assert interfaces((), PROFILES) == tuple(Interface(one.carrier, one) for one in PROFILES)
    assert len(interfaces(SHAPED_LINKS, PROFILES)) == len(SHAPED_LINKS) * len(PROFILES)
    assert interfaces((), ()) == tuple(Interface(link) for link in LOCAL_LINKS)
    assert [one.is_remote for one in interfaces(("tcp", "tcp://192.168.7.2:5555"), ())] == [False, True]


@pytest.mark.parametrize("link", ["rfcomm", "tcp://192.168.7.2:5555"])
def test_what_is_not_local_cannot_be_shaped(link: str) -> None:
    """A real radio or a real board stands only for itself."""
    with pytest.raises(SettingsError) as caught:
        interfaces((link,), PROFILES)
    assert link in caught.value.problem


def test_cases_are_all_combinations_with_links_next_to_each_other() -> None:
    """Every link is measured with every size and rate, and the links of one size and rate come next to each other."""
    measured = (Interface("tcp"), Interface("ipc"))
    planned = cases(measured, (Size(320, 240), Size(640, 480)), (50, 80), (15, 30))
    assert len(set(planned)) == len(planned) == 16
    assert [case.interface.link for case in planned] == ["tcp", "ipc"] * 8
    assert all(first.images == second.images for first, second in zip(planned[::2], planned[1::2], strict=True))


@given(st.integers(64, 4096), st.integers(64, 4096))
def test_a_rig_of_any_size_has_the_same_field_of_view(width_px: int, height_px: int) -> None:
    """Half the width over the focal length (tan of half the angle) is the same for every size, and the centre is in the middle."""
    camera = rig_of(Size(width_px, height_px)).left
    assert width_px / 2 / camera.matrix[0, 0] == pytest.approx(320 / 525, rel=1e-12)
    assert (camera.matrix[0, 2], camera.matrix[1, 2]) == ((width_px - 1) / 2, (height_px - 1) / 2)
