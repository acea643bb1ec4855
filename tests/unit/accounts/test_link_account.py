"""What reports say about what the board told."""

from common.protocol.message import BoardCounts, Rung
from common.protocol.session import StaleReason
from phone_host.accounts.link_account import LinkAccount, LinkTally, SessionAccount, rung_lines, rung_values
from phone_host.sync.quarantine import Disbelief, Suspects


def account(rung: Rung) -> LinkAccount:
    """A run with one session."""
    return LinkAccount([SessionAccount("s", BoardCounts(), BoardCounts(), rung=rung)])


def test_a_lowered_camera_is_told_of_in_one_line() -> None:
    """Rung, rate, quality and the number of changes are named; a camera that was never lowered is not mentioned."""
    assert rung_lines(LinkAccount()) == []
    assert rung_lines(account(Rung(index=0, last=3, changes=0, period_ns=50_000_000))) == []
    [line] = rung_lines(account(Rung(index=2, last=3, changes=4, period_ns=133_333_333, quality=45)))
    assert line == ("board camera: on rung 2 of 3 (7.5 frames/s, quality 45), changed 4 times by what the link carries")
    [line] = rung_lines(account(Rung(index=0, last=3, changes=4, period_ns=50_000_000)))
    assert "as it was asked for (20 frames/s)" in line


def test_what_cannot_be_set_is_null() -> None:
    """The JSON object has every value, with null for a quality or size that cannot be set on the camera."""
    assert rung_values(Rung(index=2, last=3, changes=4, period_ns=125_000_000, quality=45, width_px=320, height_px=240)) == {
        "rung": 2, "lowest_rung": 3, "changes": 4, "fps": 8.0, "quality": 45, "size": "320x240",
    }  # fmt: skip
    assert rung_values(Rung()) == {
        "rung": 0, "lowest_rung": 0, "changes": 0, "fps": None, "quality": None, "size": None,
    }  # fmt: skip


def test_a_copy_of_an_account_stays_as_it_was() -> None:
    """Nothing that the receiver counts later reaches a copy: sessions, links, suspects, reasons."""
    seen = LinkAccount([SessionAccount("s", BoardCounts(), BoardCounts())], links=(LinkTally("tcp"),))
    seen.sessions[0].disbelieved[Disbelief.FUTURE] = 2
    seen.suspects.append(Suspects(session="s", first=1, last=2, frames=2))
    seen.links[0].age.add(7)
    copied = seen.copy()
    seen.sessions[0].disbelieved[Disbelief.FUTURE] += 1
    for reason in StaleReason:
        seen.sessions[0].count_stale(reason)
    seen.sessions.append(SessionAccount("t", BoardCounts(), BoardCounts(), received=3))
    seen.suspects.append(Suspects(session="t", first=3, last=4, frames=2))
    seen.links[0].age.add(9)
    seen.links[0].frames = 5
    assert dict(copied.disbelieved) == {Disbelief.FUTURE: 2}
    assert dict(seen.disbelieved) == {Disbelief.FUTURE: 3, Disbelief.CREDIT: 1}
    assert [account.session for account in copied.sessions] == ["s"]
    assert (copied.sessions[0].duplicate, copied.sessions[0].late, copied.sessions[0].old_session) == (0, 0, 0)
    assert (len(copied.suspects), copied.links[0].frames, copied.links[0].age.spread().count) == (1, 0, 1)
