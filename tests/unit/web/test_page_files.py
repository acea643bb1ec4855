"""The page's files and secrets: what is served, in which form, and who may read the keys."""

import base64
import datetime as dt
import hashlib
import os
import ssl
from pathlib import Path

import pytest
from cryptography import x509
from cryptography.x509.oid import ExtensionOID

from common.errors import DataError, SettingsError, UnavailableError
from phone_host.web import saved_pairs
from phone_host.web.invitation import by_cable, invitation, own_names, qr_code
from phone_host.web.secret_files import kept_credentials, kept_token
from phone_host.web.settings import Credentials, PageSettings, content_policy
from phone_host.web.static_files import chosen_encoding, read_files, script_hashes
from tests.support.page_source import page_folder

NOW = dt.datetime(2026, 7, 1, 12, tzinfo=dt.UTC)


def test_files_are_served_by_their_names_only(tmp_path: Path) -> None:
    """Compressed forms have no address of their own; types are right whatever the machine's table says."""
    files = read_files(page_folder(tmp_path / "page"))
    assert set(files) == {"index.html", "main.js", "lib/a.css"}
    assert files["main.js"].kind == "text/javascript; charset=utf-8"
    assert files["main.js"].tag != files["lib/a.css"].tag
    assert read_files(tmp_path / "none") == {}


@pytest.mark.parametrize(
    ("accepted", "encoding"),
    [("", "identity"), ("gzip, deflate, br", "br"), ("gzip;q=0.5", "gzip"), ("br;q=0, gzip", "gzip"), ("BR", "br"), ("br;q=x", "identity"), ("zstd", "identity")],
)  # fmt: skip
def test_the_smallest_accepted_form_is_sent(tmp_path: Path, accepted: str, encoding: str) -> None:
    """RFC 9110, section 12.5.3: a weight of 0 is a refusal."""
    files = read_files(page_folder(tmp_path / "page"))
    assert chosen_encoding(accepted, files["main.js"]) == encoding
    assert chosen_encoding(accepted, files["lib/a.css"]) == "identity"


def test_inline_scripts_are_allowed_by_their_hash() -> None:
    """The policy names the hash of each inline script and nothing else inline; scripts with an address need none."""
    text = b'{"imports": {}}\n'
    page = b'<SCRIPT type="importmap">' + text + b'</SCRIPT ><script type="module" src="/static/main.js"></script>'
    wanted = base64.b64encode(hashlib.sha256(text).digest()).decode()
    assert script_hashes(page) == (wanted,)
    policy = content_policy((wanted,))
    assert f"script-src 'self' 'sha256-{wanted}';" in policy
    assert "unsafe" not in policy


def test_https_credentials_are_kept_and_fit(tmp_path: Path) -> None:
    """The same names later get the same certificate; its owner alone may read the keys; OpenSSL takes the chain."""
    folder = tmp_path / "keys"
    made = kept_credentials(folder, ("192.168.1.5", "laptop.local"), NOW)
    assert made.is_new_authority
    again = kept_credentials(folder, ("192.168.1.5", "laptop.local"), NOW + dt.timedelta(days=300))
    assert (again.fingerprint, again.is_new_authority) == (made.fingerprint, False)
    assert {path.stat().st_mode & 0o777 for path in folder.iterdir()} == {0o600}
    assert folder.stat().st_mode & 0o777 == 0o700
    ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER).load_cert_chain(made.chain)
    authority = x509.load_pem_x509_certificate(made.authority)
    digest = hashlib.sha256(ssl.PEM_cert_to_DER_cert(made.authority.decode())).digest()
    assert made.fingerprint == digest.hex(":").upper()
    leaf = x509.load_pem_x509_certificates(made.chain.read_bytes())[0]
    leaf.verify_directly_issued_by(authority)
    names = leaf.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    assert names.get_values_for_type(x509.DNSName) == ["laptop.local", "localhost"]
    assert leaf.not_valid_after_utc - leaf.not_valid_before_utc <= dt.timedelta(days=398)
    constraints = authority.extensions.get_extension_for_oid(ExtensionOID.NAME_CONSTRAINTS)
    assert constraints.critical


def test_another_network_needs_no_new_authority(tmp_path: Path) -> None:
    """A private address changes the certificate only; a public one, or another name, needs an authority that may sign it."""
    first = kept_credentials(tmp_path, ("192.168.1.5",), NOW)
    leaf = first.chain.read_bytes()
    second = kept_credentials(tmp_path, ("10.9.8.7",), NOW)
    assert (second.fingerprint, second.is_new_authority) == (first.fingerprint, False)
    assert second.chain.read_bytes() != leaf
    third = kept_credentials(tmp_path, ("8.8.8.8",), NOW)
    assert third.is_new_authority
    assert not kept_credentials(tmp_path, ("8.8.8.8", "10.1.1.1"), NOW).is_new_authority
    assert kept_credentials(tmp_path, ("8.8.4.4", "other"), NOW).is_new_authority
    later = kept_credentials(tmp_path, ("8.8.4.4", "other"), NOW + dt.timedelta(days=390))
    assert not later.is_new_authority
    assert kept_credentials(tmp_path, ("other",), NOW + dt.timedelta(days=3640)).is_new_authority


def test_spoiled_secrets_are_refused_in_one_line(tmp_path: Path) -> None:
    """Keys that others may read, or that are none, are named with their remedy; a lost part is made again."""
    kept_credentials(tmp_path, ("a",), NOW)
    (tmp_path / "page.pem").write_text("nonsense")
    kept_credentials(tmp_path, ("a",), NOW)
    key = tmp_path / "page-authority.key"
    key.chmod(0o644)
    with pytest.raises(DataError, match="can be read by other users"):
        kept_credentials(tmp_path, ("a",), NOW)
    key.chmod(0o600)
    key.write_text("nonsense")
    with pytest.raises(DataError, match="no certificate of this program"):
        kept_credentials(tmp_path, ("a",), NOW)
    key.unlink()
    assert kept_credentials(tmp_path, ("a",), NOW).is_new_authority
    (tmp_path / "page-authority.pem").unlink()
    assert kept_credentials(tmp_path, ("a",), NOW).is_new_authority
    other = tmp_path / "other"
    kept_credentials(other, ("a",), NOW)
    key.write_bytes((other / "page-authority.key").read_bytes())
    with pytest.raises(DataError, match="no certificate of this program"):
        kept_credentials(tmp_path, ("a",), NOW)


def test_the_token_lasts(tmp_path: Path) -> None:
    """It is made once, for its owner alone; what is no token, and a folder that is none, are refused."""
    token = kept_token(tmp_path / "new")
    assert kept_token(tmp_path / "new") == token
    assert len(token) >= 32
    path = tmp_path / "new" / "page-token"
    assert path.stat().st_mode & 0o777 == 0o600
    for text in ("short", "a" * 30 + "/../"):
        path.write_text(text)
        with pytest.raises(DataError, match="is not a token"):
            kept_token(tmp_path / "new")
    (tmp_path / "file").write_text("")
    with pytest.raises(UnavailableError, match="cannot be used"):
        kept_token(tmp_path / "file")
    with pytest.raises(UnavailableError, match="cannot be used"):
        kept_credentials(tmp_path / "file", (), NOW)


def test_no_page_for_others_without_https() -> None:
    """Off loopback the token would travel in the clear."""
    for host in ("0.0.0.0", "::", "192.168.1.5", "laptop"):
        with pytest.raises(SettingsError, match="--lan"):
            PageSettings(host=host)
    assert PageSettings(host="localhost").known_as == {"localhost"}


def test_the_invitation_says_all_that_is_needed() -> None:
    """Code, addresses, what the browser asks, the fingerprint, and the way by cable."""
    credentials = Credentials(chain=Path("c"), authority=b"", fingerprint="AB:CD", names=(), is_new_authority=True)
    text = invitation(["https://10.0.0.2:8765/?token=t", "https://laptop.local:8765/?token=t"], credentials)
    for part in ("https://10.0.0.2:8765/?token=t", "laptop.local", "AB:CD", "Advanced", "is new"):
        assert part in text
    assert "is new" not in invitation(
        ["https://a"], Credentials(chain=Path("c"), authority=b"", fingerprint="", names=())
    )
    assert "adb reverse tcp:8765 tcp:8765" in by_cable(8765)
    lines = qr_code("https://10.0.0.2:8765/?token=" + "t" * 32).splitlines()
    assert len({len(line) for line in lines}) == 1
    assert len(lines[0]) <= 48
    assert all("127.0.0.1" not in name and "%" not in name for name in own_names())


def test_saved_pairs_are_files_that_a_run_wrote(tmp_path: Path) -> None:
    """Other names, links and folders are not listed and not opened; numbers have one spelling."""
    pair = tmp_path / "pair-000003"
    pair.mkdir()
    (pair / "cloud.ply").write_bytes(b"ply")
    (pair / "secret.txt").write_bytes(b"no")
    (pair / "depth.png").symlink_to("/etc/passwd")
    (tmp_path / "pair-1000000").mkdir()
    (tmp_path / "pair-0000004").mkdir()
    (tmp_path / "pair-000005").symlink_to(pair)
    (tmp_path / "pair-000006").write_bytes(b"")
    os.mkfifo(pair / "left.png")
    folder = str(tmp_path)
    assert [each.number for each in saved_pairs.saved_pairs(folder)] == [3, 1000000]
    assert saved_pairs.saved_pairs(folder)[0].files == ("cloud.ply",)
    with saved_pairs.open_saved(folder, 3, "cloud.ply") as file:
        assert file.read() == b"ply"
    for number, name in (
        (3, "secret.txt"),
        (3, "depth.png"),
        (3, "left.png"),
        (3, "../pair-000003/cloud.ply"),
        (5, "cloud.ply"),
        (9, "cloud.ply"),
    ):
        with pytest.raises(FileNotFoundError):
            saved_pairs.open_saved(folder, number, name)
    with pytest.raises(FileNotFoundError):
        saved_pairs.open_saved("", 3, "cloud.ply")
    assert saved_pairs.saved_pairs("") == saved_pairs.saved_pairs(str(tmp_path / "none")) == ()
