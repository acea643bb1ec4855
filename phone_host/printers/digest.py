"""HTTP's digest authentication, as PrusaLink asks for it: a password that never travels. Pure. Source: RFC 7616, section 3.4."""

import hashlib
import re
from typing import Final

_PART: Final = re.compile(r'(\w+)\s*=\s*(?:"([^"]*)"|([^\s,]+))')
_HASHES: Final = {"MD5": hashlib.md5, "SHA-256": hashlib.sha256}


def digest_header(challenge: str, user: str, password: str, asked: tuple[str, str], client_nonce: str) -> str:
    """Return the header Authorization that answers a challenge; empty: it is no challenge that is spoken here.

    Args:
        challenge: the header WWW-Authenticate.
        user: name.
        password: of the user.
        asked: method of the request, and its path and query.
        client_nonce: a text that nobody can guess.
    """
    scheme, _, rest = challenge.strip().partition(" ")
    parts = {name.lower(): quoted or bare for name, quoted, bare in _PART.findall(rest)}
    algorithm = parts.get("algorithm", "MD5").upper()
    realm, nonce, opaque = (parts.get(name, "") for name in ("realm", "nonce", "opaque"))
    if scheme.lower() != "digest" or not nonce or algorithm not in _HASHES or '"' in user:
        return ""

    def hashed(text: str) -> str:
        return _HASHES[algorithm](text.encode()).hexdigest()

    secret, request = hashed(f"{user}:{realm}:{password}"), hashed(":".join(asked))
    said = [f'username="{user}"', f'realm="{realm}"', f'nonce="{nonce}"', f'uri="{asked[1]}"', f"algorithm={algorithm}"]
    if "auth" in [each.strip() for each in parts.get("qop", "").split(",")]:
        said += ["qop=auth", "nc=00000001", f'cnonce="{client_nonce}"']
        answer = hashed(f"{secret}:{nonce}:00000001:{client_nonce}:auth:{request}")
    else:
        answer = hashed(f"{secret}:{nonce}:{request}")
    said += [f'response="{answer}"', *([f'opaque="{opaque}"'] if opaque else [])]
    return f"Digest {', '.join(said)}"
