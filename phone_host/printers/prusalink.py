"""PrusaLink, the server of Prusa's printers, by its HTTP API. Never tried on a printer: written from its description, against a stand-in.

Source: Prusa-Link-Web, spec/openapi.yaml (https://github.com/prusa3d/Prusa-Link-Web); how other programs speak to it.
"""

import hashlib
import math
import re
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Final

from phone_host.printers.door import Heat
from phone_host.printers.printer_uri import ServerUri
from phone_host.printers.server import (
    Condition,
    KeyedServer,
    ServerState,
    note_refusal,
    pieces,
    require_good,
    size_bytes,
)
from phone_host.printers.server_answer import Answer, or_zero
from phone_host.printers.server_talk import ANSWER_S, ORDER_S

_OF_STATE: Final = {
    "IDLE": Condition.READY,
    "READY": Condition.READY,
    "PRINTING": Condition.PRINTING,
    "PAUSED": Condition.PAUSED,
    "FINISHED": Condition.DONE,
    "STOPPED": Condition.CANCELLED,
    "BUSY": Condition.BUSY,
    "ATTENTION": Condition.PAUSED,
    "ERROR": Condition.ERROR,
}
_UNAUTHORIZED: Final = 401
_ATTENTION: Final = "it waits for somebody at the printer"
_USUAL_STORE: Final = "/usb"
_PART: Final = re.compile(r'(\w+)\s*=\s*(?:"([^"]*)"|([^\s,]+))')
_HASHES: Final = {"MD5": hashlib.md5, "SHA-256": hashlib.sha256}


class PrusaLink(KeyedServer):
    """See PrintServer.

    Args:
        uri: where it is.
        key: of its API, or USER:PASSWORD; empty: none.
    """

    def __init__(self, uri: ServerUri, key: str) -> None:
        super().__init__(uri, key, "the printer shows it under Settings, Network, PrusaLink")
        self._user, _, self._password = key.partition(":") if ":" in key else ("", "", "")
        self._job = self._challenge = ""

    def state(self) -> ServerState:
        """See PrintServer."""
        answer = self._ask("GET", "/api/v1/status")
        require_good(answer, "to tell how its printer is")
        said = answer.json()
        printer, job = said["printer"], said["job"]
        self._job = "" if math.isnan(job["id"].number) else f"{job['id'].number:.0f}"
        name = printer["state"].text
        condition = _OF_STATE.get(name, Condition.BUSY)
        share = min(max(or_zero(job["progress"].number) / 100, 0.0), 1.0)
        if condition is Condition.DONE:
            share = 1.0
        heat = Heat(
            (or_zero(printer["temp_nozzle"].number), or_zero(printer["target_nozzle"].number)),
            (or_zero(printer["temp_bed"].number), or_zero(printer["target_bed"].number)),
        )
        words = printer["status_printer"]["message"].text or (_ATTENTION if name == "ATTENTION" else "")
        return ServerState(
            condition=condition,
            share=share,
            seconds_left=job["time_remaining"].number,
            heat=heat,
            is_hot=heat.nozzle[1] > 0 or heat.bed[1] > 0,
            words=words,
        )

    def start(self, gcode: Path, name: str, sent: Callable[[float], None]) -> None:
        """See PrintServer."""
        target = f"/api/v1/files{self._store()}/{name}"
        headers = {"Content-Type": "text/x.gcode", "Print-After-Upload": "?1", "Overwrite": "?1"}
        headers |= self._proof("PUT", target)
        answer = self._talk.hand_over("PUT", target, headers, pieces(gcode, sent), size_bytes(gcode))
        require_good(self._accepted(answer), "the file")

    def pause(self) -> None:
        """See PrintServer."""
        note_refusal(self._ask("PUT", f"/api/v1/job/{self._job}/pause"), "pause")

    def go_on(self) -> None:
        """See PrintServer."""
        note_refusal(self._ask("PUT", f"/api/v1/job/{self._job}/resume"), "resume")

    def cancel(self) -> None:
        """See PrintServer. The firmware switches the heaters off when a print is stopped."""
        if not self._job:
            self.state()
        if self._job:
            require_good(self._ask("DELETE", f"/api/v1/job/{self._job}", ORDER_S), "to end the print")

    def cool(self) -> bool:
        """See PrintServer."""
        return False

    def halt(self) -> str:
        """See PrintServer."""
        return ""

    def _store(self) -> str:
        """Return where files go: the first store that is there and takes them."""
        answer = self._ask("GET", "/api/v1/storage")
        require_good(answer, "to tell where files go")
        for store in answer.json()["storage_list"].parts:
            path = store["path"].text
            if path.strip("/").isalnum() and store["available"].is_true and not store["read_only"].is_true:
                return f"/{path.strip('/')}"
        return _USUAL_STORE

    def _proof(self, method: str, target: str) -> dict[str, str]:
        """Return the headers that show the key, or prove that the password is known."""
        if not self._user:
            return self._headers()
        if not self._challenge:
            return {}
        said = digest_header(self._challenge, self._user, self._password, (method, target), secrets.token_hex(8))
        return {"Authorization": said} if said else {}

    def _ask(self, method: str, target: str, patience_s: float = ANSWER_S) -> Answer:
        """Ask; where a user's password is given and asked for, ask again with its proof."""
        answer = self._talk.ask(method, target, self._proof(method, target), patience_s=patience_s)
        if answer.status == _UNAUTHORIZED and self._user and answer.challenge:
            self._challenge = answer.challenge
            answer = self._talk.ask(method, target, self._proof(method, target), patience_s=patience_s)
        return self._accepted(answer)


def digest_header(challenge: str, user: str, password: str, asked: tuple[str, str], client_nonce: str) -> str:
    """Return the header Authorization that answers a challenge of HTTP's digest authentication; empty: it is none that is spoken here.

    The password never travels. Source: RFC 7616, section 3.4.
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
