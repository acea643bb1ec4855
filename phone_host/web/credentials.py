"""Keeps the page's own certificate authority and its certificate for https in a folder.

Rules: keys are for their owner only (0600 in a folder of 0700) and appear whole. The authority can sign only for private
addresses and the names that it was made for (name constraints, RFC 5280 section 4.2.1.10), so whoever trusts it trusts it
with nothing else. The certificate is made again when the names change or it ends soon; the authority only if it may not
sign a name, because every browser would have to be told again.
"""

import datetime as dt
import ipaddress
import secrets
from collections.abc import Iterable
from pathlib import Path
from typing import Final

from cryptography import x509
from cryptography.hazmat.primitives import hashes, serialization
from cryptography.hazmat.primitives.asymmetric import ec
from cryptography.x509.oid import ExtendedKeyUsageOID, NameOID

from common.errors import DataError
from common.files import opened_folder, read_file
from phone_host.web.secret_files import MOST_BYTES, read_secret, unusable, write_secret
from phone_host.web.settings import Credentials

_AUTHORITY, _AUTHORITY_KEY, _CHAIN = "page-authority.pem", "page-authority.key", "page.pem"
_AUTHORITY_DAYS: Final = 3650
_LEAF_DAYS: Final = 397  # browsers accept no longer ones (CA/Browser Forum, ballot SC-31)
_RENEW_DAYS: Final = 30
_EARLIER: Final = dt.timedelta(days=1)  # clocks of phones and boards differ

_PRIVATE: Final = (
    "10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "169.254.0.0/16", "127.0.0.0/8", "fc00::/7", "fe80::/10", "::1/128",
)  # fmt: skip
"""RFC 1918, 3927, 4193, 4291, and loopback: addresses that change with every network, and that mean nobody else."""


def kept(folder: Path, names: Iterable[str], now: dt.datetime) -> Credentials:
    """Return what https needs for these names; made if it is missing or does not fit.

    Args:
        folder: where it is kept; created with mode 0700.
        names: names and addresses of this machine; those of loopback are added.
        now: now, with its time zone.

    Raises:
        DataError: a file is not what we wrote, or others may read a key.
        UnavailableError: the folder cannot be used.
    """
    wanted = tuple(dict.fromkeys([*(name.strip("[]").lower() for name in names), "localhost", "127.0.0.1", "::1"]))
    try:
        with opened_folder(folder, make=True) as opened:
            return _kept(opened, folder, wanted, now)
    except OSError as error:
        raise unusable(folder, error) from error


def _kept(opened: int, folder: Path, names: tuple[str, ...], now: dt.datetime) -> Credentials:
    known = _authority(opened, folder)
    is_new = known is None or not _may_sign(known[0], names) or _ends_soon(known[0], now)
    if known is None or is_new:
        known = _new_authority(names, now)
        write_secret(opened, _AUTHORITY_KEY, _key_bytes(known[1]))
        write_secret(opened, _AUTHORITY, known[0].public_bytes(serialization.Encoding.PEM))
    chain = read_secret(opened, folder / _CHAIN)
    if is_new or chain is None or not _fits(chain, known[0], names, now):
        write_secret(opened, _CHAIN, _new_chain(names, known, now))
    return Credentials(
        chain=folder / _CHAIN,
        authority=known[0].public_bytes(serialization.Encoding.PEM),
        fingerprint=known[0].fingerprint(hashes.SHA256()).hex(":").upper(),
        names=names,
        is_new_authority=is_new,
    )


_Authority = tuple[x509.Certificate, ec.EllipticCurvePrivateKey]


def _authority(opened: int, folder: Path) -> _Authority | None:
    key_bytes = read_secret(opened, folder / _AUTHORITY_KEY)
    if key_bytes is None:
        return None
    try:
        certificate = x509.load_pem_x509_certificate(read_file(opened, folder / _AUTHORITY, MOST_BYTES)[0])
        key = serialization.load_pem_private_key(key_bytes, None)
    except FileNotFoundError:
        return None
    except ValueError as error:
        raise _bad(folder / _AUTHORITY) from error
    if not isinstance(key, ec.EllipticCurvePrivateKey) or key.public_key() != certificate.public_key():
        raise _bad(folder / _AUTHORITY)
    return certificate, key


def _new_authority(names: tuple[str, ...], now: dt.datetime) -> _Authority:
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, f"tandemscan page {secrets.token_hex(4)}")])
    allowed = [x509.IPAddress(ipaddress.ip_network(network)) for network in _PRIVATE]
    others = [name for name in map(_general_name, names) if not _is_within(name, allowed)]
    permitted = [*allowed, *(_as_network(name) for name in others)]
    certificate = (
        _builder(subject, subject, key, now, _AUTHORITY_DAYS)
        .add_extension(x509.BasicConstraints(ca=True, path_length=0), critical=True)
        .add_extension(_usage(signs_certificates=True), critical=True)
        .add_extension(x509.NameConstraints(permitted, None), critical=True)
        .add_extension(x509.SubjectKeyIdentifier.from_public_key(key.public_key()), critical=False)
        .sign(key, hashes.SHA256())
    )
    return certificate, key


def _new_chain(names: tuple[str, ...], authority: _Authority, now: dt.datetime) -> bytes:
    """Make a certificate for these names, and return its key, itself and the authority's, PEM."""
    key = ec.generate_private_key(ec.SECP256R1())
    subject = x509.Name([x509.NameAttribute(NameOID.COMMON_NAME, "tandemscan page")])
    signer = authority[0].extensions.get_extension_for_class(x509.SubjectKeyIdentifier).value
    certificate = (
        _builder(subject, authority[0].subject, key, now, _LEAF_DAYS)
        .add_extension(x509.BasicConstraints(ca=False, path_length=None), critical=True)
        .add_extension(_usage(signs_certificates=False), critical=True)
        .add_extension(x509.ExtendedKeyUsage([ExtendedKeyUsageOID.SERVER_AUTH]), critical=False)
        .add_extension(x509.SubjectAlternativeName(map(_general_name, names)), critical=False)
        .add_extension(x509.AuthorityKeyIdentifier.from_issuer_subject_key_identifier(signer), critical=False)
        .sign(authority[1], hashes.SHA256())
    )
    pem = serialization.Encoding.PEM
    return _key_bytes(key) + certificate.public_bytes(pem) + authority[0].public_bytes(pem)


def _builder(
    subject: x509.Name, issuer: x509.Name, key: ec.EllipticCurvePrivateKey, now: dt.datetime, days: int
) -> x509.CertificateBuilder:
    return (
        x509.CertificateBuilder()
        .subject_name(subject)
        .issuer_name(issuer)
        .public_key(key.public_key())
        .serial_number(x509.random_serial_number())
        .not_valid_before(now - _EARLIER)
        .not_valid_after(now - _EARLIER + dt.timedelta(days=days))
    )


def _usage(*, signs_certificates: bool) -> x509.KeyUsage:
    return x509.KeyUsage(
        digital_signature=not signs_certificates, key_cert_sign=signs_certificates, crl_sign=False, content_commitment=False,
        key_encipherment=False, data_encipherment=False, key_agreement=False, encipher_only=False, decipher_only=False,
    )  # fmt: skip


def _fits(chain: bytes, authority: x509.Certificate, names: tuple[str, ...], now: dt.datetime) -> bool:
    """Whether the kept certificate is of this authority, for exactly these names, and lasts."""
    try:
        certificate = x509.load_pem_x509_certificates(chain)[0]
        certificate.verify_directly_issued_by(authority)
        told = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    except Exception:  # noqa: BLE001 - whatever it is, it is not ours, and is replaced
        return False
    return set(told) == set(map(_general_name, names)) and not _ends_soon(certificate, now)


def _may_sign(authority: x509.Certificate, names: tuple[str, ...]) -> bool:
    try:
        found = authority.extensions.get_extension_for_class(x509.NameConstraints).value
    except x509.ExtensionNotFound:
        return False
    return all(_is_within(_general_name(name), found.permitted_subtrees or []) for name in names)


def _is_within(name: x509.GeneralName, allowed: Iterable[x509.GeneralName]) -> bool:
    if isinstance(name, x509.DNSName):
        return name in list(allowed)
    address = ipaddress.ip_address(str(name.value))
    return any(address in ipaddress.ip_network(str(each.value)) for each in allowed if isinstance(each, x509.IPAddress))


def _general_name(name: str) -> x509.GeneralName:
    try:
        return x509.IPAddress(ipaddress.ip_address(name.partition("%")[0]))
    except ValueError:
        return x509.DNSName(name)


def _as_network(name: x509.GeneralName) -> x509.GeneralName:
    """Name constraints hold addresses as networks."""
    return x509.IPAddress(ipaddress.ip_network(name.value)) if isinstance(name, x509.IPAddress) else name


def _ends_soon(certificate: x509.Certificate, now: dt.datetime) -> bool:
    return (
        not certificate.not_valid_before_utc <= now < certificate.not_valid_after_utc - dt.timedelta(days=_RENEW_DAYS)
    )


def _key_bytes(key: ec.EllipticCurvePrivateKey) -> bytes:
    form = serialization.PrivateFormat.PKCS8
    return key.private_bytes(serialization.Encoding.PEM, form, serialization.NoEncryption())


def _bad(path: Path) -> DataError:
    return DataError(
        f"{path} and its key are no certificate of this program", "remove both: the next start makes new ones"
    )
