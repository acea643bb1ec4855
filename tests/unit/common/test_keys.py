"""The folder of keys, on a real disk."""

import os
import stat
import threading
from pathlib import Path

import pytest
import zmq
from hypothesis import given
from hypothesis import strategies as st
from zmq.utils import z85

from common.errors import DataError, SettingsError, UnavailableError
from common.keys import KeyFolder, default_folder
from common.keys_verb import change
from common.peers import Peer, clean_name, is_key, peer_at

WHEN = "2026-01-01T00:00:00+0000"


def some_key() -> str:
    """A public key as ZeroMQ makes them."""
    return str(zmq.curve_keypair()[0].decode())


def mode(path: Path) -> int:
    """The permissions of a file."""
    return stat.S_IMODE(path.stat().st_mode)


def test_a_key_is_made_once_and_for_its_owner_only(tmp_path: Path) -> None:
    """The first use makes the folder (0700) and the key (0600) whatever the umask. Later uses read the same key. The public key belongs to the secret one."""
    before = os.umask(0)
    try:
        own = KeyFolder(tmp_path / "a" / "b").own()
    finally:
        os.umask(before)
    assert KeyFolder(tmp_path / "a" / "b").own() == own
    assert zmq.curve_public(own.secret.encode()).decode() == own.public
    assert mode(tmp_path / "a" / "b") == 0o700
    assert mode(tmp_path / "a" / "b" / "key") == 0o600
    assert [path.name for path in (tmp_path / "a" / "b").iterdir()] == ["key"]


def test_many_at_once_make_one_key(tmp_path: Path) -> None:
    """The first process makes the key; all others read it."""
    seen: list[str] = []
    threads = [threading.Thread(target=lambda: seen.append(KeyFolder(tmp_path).own().public)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(seen) == 8
    assert len(set(seen)) == 1


def test_a_new_key_takes_the_place_of_the_old_one(tmp_path: Path) -> None:
    """`renew` gives another key, which is kept."""
    folder = KeyFolder(tmp_path)
    old, new = folder.own(), folder.renew()
    assert new != old
    assert folder.own() == new


@pytest.mark.parametrize(
    "content", [b"", b"#" * 40 + b"\n", b"\xff" * 40, b"-----BEGIN PRIVATE KEY-----\n", b"0" * 39 + b"\n"]
)
def test_a_spoiled_key_file_is_one_line(tmp_path: Path, content: bytes) -> None:
    """A key file without a key is named, with the remedy, and left unchanged."""
    (tmp_path / "key").write_bytes(content)
    (tmp_path / "key").chmod(0o600)
    with pytest.raises(DataError, match="key") as caught:
        KeyFolder(tmp_path).own()
    assert "\n" not in str(caught.value)
    assert (tmp_path / "key").read_bytes() == content


@pytest.mark.parametrize("name", ["key", "peers.json"])
def test_a_file_that_others_may_read_is_refused(tmp_path: Path, name: str) -> None:
    """The line names the file, its mode and chmod."""
    folder = KeyFolder(tmp_path)
    folder.own()
    folder.add(Peer(name="phone", key=some_key(), added=WHEN))
    (tmp_path / name).chmod(0o640)
    with pytest.raises(DataError, match=rf"{name}.*0640.*chmod 600"):
        folder.own() if name == "key" else folder.peers()


@pytest.mark.parametrize(
    "text", ["", "{}", "[1]", '[{"name": "x"}]', "[" * 5000, '[{"name": 1, "key": "", "added": ""}]', "null"]
)
def test_a_spoiled_file_of_peers_is_one_line(tmp_path: Path, text: str) -> None:
    """Any content of the file of peers is a list of peers or one DataError that names the file."""
    (tmp_path / "peers.json").write_text(text)
    (tmp_path / "peers.json").chmod(0o600)
    folder = KeyFolder(tmp_path)
    with pytest.raises(DataError, match=r"peers\.json") as caught:
        folder.peers()
    assert "\n" not in str(caught.value)


def test_peers_are_added_renewed_and_forgotten(tmp_path: Path) -> None:
    """Names stay unique, a key that comes again replaces its old entry, and a forgotten peer is gone."""
    folder, first, second = KeyFolder(tmp_path), some_key(), some_key()
    assert folder.add(Peer(name="phone", key=first, added=WHEN)).name == "phone"
    assert folder.add(Peer(name="phone", key=second, added=WHEN)).name == "phone-2"
    assert folder.add(Peer(name="phone", key=first, added=WHEN, address="tcp://192.0.2.1:5555")).name == "phone"
    assert {(peer.name, peer.key) for peer in folder.peers()} == {("phone", first), ("phone-2", second)}
    assert mode(tmp_path / "peers.json") == 0o600
    assert folder.forget("phone").key == first
    assert [peer.name for peer in folder.peers()] == ["phone-2"]
    with pytest.raises(SettingsError, match="phone-2"):
        folder.forget("phone")
    with pytest.raises(SettingsError, match="is not a public key"):
        folder.add(Peer(name="phone", key="short", added=WHEN))


def test_the_state_changes_with_the_file(tmp_path: Path) -> None:
    """The recorded state of the peers changes with every change of the file, so a listener misses none."""
    folder = KeyFolder(tmp_path)
    states = [folder.peers_state]
    for number in range(5):
        folder.add(Peer(name=f"host{number}", key=some_key(), added=WHEN))
        states.append(folder.peers_state)
    folder.forget("host3")
    states.append(folder.peers_state)
    assert len(set(states)) == len(states)


def test_a_folder_that_cannot_be_used_is_one_line(tmp_path: Path) -> None:
    """A file in place of the folder is named."""
    (tmp_path / "file").write_text("")
    with pytest.raises(UnavailableError, match="file"):
        KeyFolder(tmp_path / "file").own()


def test_where_keys_lie() -> None:
    """The service's folder comes first, then XDG_CONFIG_HOME if it is absolute, then ~/.config."""
    service = {"STATE_DIRECTORY": "/var/lib/a:/var/lib/b", "HOME": "/home/me"}
    assert default_folder(service, service=True) == Path("/var/lib/a")
    assert default_folder(service, service=False) == Path("/home/me/.config/tandemscan")
    assert default_folder({"XDG_CONFIG_HOME": "/x", "HOME": "/y"}, service=False) == Path("/x/tandemscan")
    assert default_folder({"XDG_CONFIG_HOME": "x", "HOME": "/y"}, service=False) == Path("/y/.config/tandemscan")


def test_who_is_at_an_address() -> None:
    """The peer paired there last, else the one of that name, else the only one; with several and no match, none."""
    bone = Peer(name="bone", key="", added=WHEN, address="tcp://192.168.7.2:5555")
    other = Peer(name="other", key="", added=WHEN, address="tcp://192.168.7.2:5555")
    far = Peer(name="far", key="", added=WHEN, address="tcp://far:5555")
    assert peer_at((bone, other, far), "tcp://192.168.7.2:5555") == other
    assert peer_at((bone, other, far), "tcp://BONE.local:5555") == bone
    assert peer_at((bone,), "tcp://10.0.0.9:5555") == bone
    assert peer_at((bone, far), "tcp://10.0.0.9:5555") is None
    assert peer_at((), "tcp://10.0.0.9:5555") is None


@given(st.text(max_size=200))
def test_any_name_becomes_a_plain_one(name: str) -> None:
    """A stranger's name can neither break a line of the log nor be empty or long."""
    cleaned = clean_name(name)
    assert 1 <= len(cleaned) <= 64
    assert all(c.isascii() and (c.isalnum() or c in "._-") for c in cleaned)


@given(st.binary(min_size=32, max_size=32))
def test_every_256_bits_are_a_key(raw: bytes) -> None:
    """The form of a key is that of 32 bytes in Z85, as ZeroMQ encodes it."""
    text = z85.encode(raw).decode()
    assert is_key(text)
    assert not is_key(text[:-1])
    assert not is_key(text[:-1] + " ")
    assert not is_key("#####" + text[5:])


def test_the_codes_typed_last_are_kept(tmp_path: Path) -> None:
    """Every later process knows the newest 64 proved codes. Only the owner may read them; a file that others may read is refused."""
    assert KeyFolder(tmp_path / "k").spent_codes() == ()
    for number in range(70):
        KeyFolder(tmp_path / "k").spend(f"{number:06d}")
    assert KeyFolder(tmp_path / "k").spent_codes() == tuple(f"{number:06d}" for number in range(6, 70))
    (tmp_path / "k" / "spent-codes").chmod(0o644)
    with pytest.raises(DataError, match="chmod"):
        KeyFolder(tmp_path / "k").spent_codes()


def test_a_name_that_is_changed_is_told(tmp_path: Path) -> None:
    """`keys --add` says under which name the machine is kept if the wanted one is taken or cannot be one; otherwise nothing."""
    folder = KeyFolder(tmp_path)

    def add(name: str) -> str:
        return change(folder, forget=None, new=False, add=(name, some_key()), address="", when=WHEN)

    assert add("phone") == ""
    assert add("phone") == "'phone' is kept as phone-2: another machine has that name"
    assert add("my phone") == "'my phone' is kept as my-phone: names are of letters, digits and ._-"
    assert [peer.name for peer in folder.peers()] == ["phone", "phone-2", "my-phone"]
    assert change(folder, forget="phone", new=False, add=None, address="", when=WHEN) == ""
