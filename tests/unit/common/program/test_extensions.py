"""Matchers, cameras and links of other packages: a real distribution in a folder on sys.path registers them."""

import importlib
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest

from common.camera.factory import open_camera, parse_camera
from common.errors import SettingsError, UnavailableError
from common.link.base import SendResult
from common.link.factory import open_link, open_links, parse_link
from phone_host.camera.factory import check_camera
from phone_host.camera.factory import open_camera as open_host_camera
from phone_host.model import RectifiedPair
from phone_host.stereo.match import MatchSettings, create_matcher
from phone_host.stereo.matcher_names import MatcherName, RegisteredMatcher, matcher_named

_MODULE = '''
"""Somebody's package."""

import numpy as np

from common.camera.base import CameraHealth, Ended, Offers
from common.errors import SettingsError, UnavailableError
from common.frame import PixelFormat
from common.link.base import SendResult
from common.protocol.message import CameraDescription, Pacing


class Flat:
    def __init__(self, disparities):
        self.disparities = disparities

    def match(self, pair):
        return np.full(pair.left.shape[:2], self.disparities - 1, np.float32)


class Still:
    pollable = None
    offers = Offers()
    health = CameraHealth()

    def __init__(self, request):
        if request.path == "gone":
            raise UnavailableError("still:gone is not there", "plug it in")
        self.request = request
        width = int(dict(request.options).get("width", "8"))
        self.description = CameraDescription(
            name="still", width_px=width, height_px=6, pixel_format=PixelFormat.MJPEG, period_ns=1_000_000, pacing=Pacing.CLOCK
        )

    def adapt(self, mode, now_ns): ...
    def due_ns(self, now_ns): return now_ns
    def read(self, now_ns): return [Ended()]
    def anchor(self, exposed_ns, index): ...
    def steer(self, later_ns, now_ns): ...
    def pause(self): ...
    def resume(self, now_ns): ...
    def close(self): ...


class Nowhere:
    kind = "nowhere"
    pollables = ()
    due_ns = 2**63 - 1
    self_paced = False

    def __init__(self, request):
        if "loss" in dict(request.uri.options) and not dict(request.uri.options)["loss"].isdigit():
            raise SettingsError("nowhere: loss is no number", "give percents")
        self.request = request
        self.dialled = {}

    def ready(self, connection): return True
    def receive(self): return iter(())
    def send(self, connection, header, payload): return SendResult.SENT
    def close(self): ...


def two(one, other): ...
def broken(request): raise RuntimeError("no such chip")
def empty(request): return object()

number = 5
'''


@pytest.fixture
def install(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[str], None]]:
    """Install a distribution that registers what a text says, in the form of entry_points.txt."""
    (tmp_path / "somebodys.py").write_text(_MODULE)
    monkeypatch.syspath_prepend(tmp_path)

    def installed(entry_points: str, name: str = "somebodys") -> None:
        folder = tmp_path / f"{name}-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (folder / "entry_points.txt").write_text(entry_points)
        importlib.invalidate_caches()

    yield installed
    sys.modules.pop("somebodys", None)


def pair() -> RectifiedPair:
    return RectifiedPair(np.zeros((4, 5), np.uint8), np.zeros((4, 5), np.uint8))


def test_a_registered_matcher_is_used_by_its_name(install: Callable[[str], None]) -> None:
    """The name of an entry point is a matcher's name, and what it registers is called with the number of disparities."""
    install("[tandemscan.matchers]\nflat = somebodys:Flat\n")
    named = matcher_named("flat")
    assert named == RegisteredMatcher("flat")
    assert np.array_equal(create_matcher(MatchSettings(named, 7)).match(pair()), np.full((4, 5), 6, np.float32))


def test_our_own_names_cannot_be_taken(install: Callable[[str], None]) -> None:
    """A package that registers one of our names changes nothing: ours are looked up first."""
    install("[tandemscan.matchers]\nsgbm = somebodys:Flat\n[tandemscan.cameras]\nreplay = somebodys:Still\n")
    assert matcher_named("sgbm") is MatcherName.SGBM
    with pytest.raises(UnavailableError):
        open_camera("replay:/nowhere/at/all", "host", 0)


def test_an_unknown_matcher_is_refused_with_all_names(install: Callable[[str], None]) -> None:
    """The error for an unknown matcher names ours and the installed ones."""
    install("[tandemscan.matchers]\nflat = somebodys:Flat\n")
    with pytest.raises(SettingsError, match="block or sgbm or tandem or flat"):
        matcher_named("magic")


def test_a_registered_camera_is_opened_by_its_scheme(install: Callable[[str], None]) -> None:
    """The name of an entry point is a camera URI's scheme. The camera gets path, options, clock and the time, and the host accepts it too."""
    install("[tandemscan.cameras]\nstill = somebodys:Still\n")
    check_camera("still:somewhere?width=9")
    camera = open_camera("still:somewhere?width=9&x=1", "board", 5)
    request = camera.request  # type: ignore[attr-defined]  # of the package's own class
    assert (request.path, request.options, request.clock) == ("somewhere", (("width", "9"), ("x", "1")), "board")
    assert request.now_ns == 5
    assert open_host_camera("still:somewhere", "host", 0).description.width_px == 8
    with pytest.raises(UnavailableError, match="still:gone"):
        open_camera("still:gone", "board", 5)


def test_a_registered_link_is_opened_by_its_scheme(install: Callable[[str], None]) -> None:
    """The name of an entry point is a link URI's scheme. The link gets the address, who listens, its options, and which side this is."""
    install("[tandemscan.links]\nnowhere = somebodys:Nowhere\n")
    uri = parse_link("nowhere://here?loss=3&bind=1", listens_by_default=False)
    assert (uri.address, uri.listens, uri.options) == ("nowhere://here", True, (("loss", "3"),))
    (link,) = open_links([uri], board=True)
    assert link.kind == "nowhere"
    assert link.send(b"", b"", b"") is SendResult.SENT
    request = link.request  # type: ignore[attr-defined]  # of the package's own class
    assert request.board
    assert request.uri == uri
    with pytest.raises(SettingsError, match="loss is no number"):
        open_link(parse_link("nowhere://here?loss=much", listens_by_default=False))


@pytest.mark.parametrize("uri", ["nowhere://", "nowhere:", "nowhere", "elsewhere://x", "nowhere://x?bind=1&connect=1"])
def test_a_link_that_makes_no_sense_is_refused(install: Callable[[str], None], uri: str) -> None:
    """A registered scheme without an address, an unregistered one, and contradicting sides are wrong settings."""
    install("[tandemscan.links]\nnowhere = somebodys:Nowhere\n")
    with pytest.raises(SettingsError):
        parse_link(uri, listens_by_default=True)


@pytest.mark.parametrize(
    ("reference", "words"),
    [
        ("nobodys:Flat", "cannot be loaded .*nobodys"),
        ("somebodys:Missing", "cannot be loaded .*Missing"),
        ("somebodys:number", "no callable"),
        ("somebodys:two", "cannot be called with .int."),
        ("somebodys:broken", "no such chip"),
        ("somebodys:empty", "gave no Matcher: it has no match"),
    ],
)
def test_what_does_not_fit_is_a_wrong_setting(install: Callable[[str], None], reference: str, words: str) -> None:
    """An entry point that cannot be loaded, called or used is refused in one line that names it, with a remedy."""
    install(f"[tandemscan.matchers]\nflat = {reference}\n")
    with pytest.raises(SettingsError, match=words) as refused:
        create_matcher(MatchSettings(matcher_named("flat"), 4))
    assert reference in refused.value.problem
    assert refused.value.remedy


def test_what_is_no_camera_and_no_link_is_refused(install: Callable[[str], None]) -> None:
    """What an entry point gives must have every member of the protocol; otherwise it is refused with a list of the missing ones."""
    install("[tandemscan.cameras]\nstill = somebodys:empty\n[tandemscan.links]\nnowhere = somebodys:empty\n")
    with pytest.raises(SettingsError, match="gave no Camera: it has no adapt, anchor"):
        open_camera("still:x", "host", 0)
    with pytest.raises(SettingsError, match="gave no Link: it has no close, dialled"):
        open_link(parse_link("nowhere://x", listens_by_default=False))


def test_two_packages_of_one_name_are_refused(install: Callable[..., None]) -> None:
    """When two packages register the same name, nobody can say which is meant."""
    install("[tandemscan.matchers]\nflat = somebodys:Flat\n")
    install("[tandemscan.matchers]\nflat = others:Flat\n", "others")
    with pytest.raises(SettingsError, match="registered by others:Flat and by somebodys:Flat"):
        create_matcher(MatchSettings(matcher_named("flat"), 4))


def test_nothing_is_loaded_to_read_a_uri(install: Callable[[str], None]) -> None:
    """No foreign code is run to check settings: a package is imported only when its camera, link or matcher is opened."""
    install("[tandemscan.matchers]\nf = somebodys:Flat\n[tandemscan.cameras]\ns = somebodys:Still\n")
    matcher_named("f")
    assert parse_camera("s:x", "host") is None
    assert "somebodys" not in sys.modules
