"""A program that talks to the page's API as a browser does, and the real server it talks to."""

import json
import re
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.support.programs import Program, host, until


class PageClient:
    """One client.

    Args:
        url: the first address, with its token.
    """

    def __init__(self, url: str) -> None:
        self.url = url
        self.address, _, self._token = url.partition("/?token=")

    def get(self, path: str) -> bytes:
        """Get something."""
        with urllib.request.urlopen(f"{self.address}{path}", timeout=60) as answer:
            return bytes(answer.read())

    def state(self) -> Any:
        """The state now."""
        return json.loads(self.get("/api/state"))

    def post(self, path: str, content: object) -> Any:
        """Post JSON; return the answer, also that of a refusal."""
        headers = {"Authorization": f"Bearer {self._token}", "Content-Type": "application/json"}
        asked = urllib.request.Request(f"{self.address}{path}", json.dumps(content).encode(), headers)
        try:
            with urllib.request.urlopen(asked, timeout=60) as answer:
                return json.loads(answer.read())
        except urllib.error.HTTPError as refused:
            return json.loads(refused.read())

    def do(self, what: str, **values: str) -> Any:
        """Give a command; the option `board_side` is called board-side."""
        return self.post(
            "/api/command", {"do": what, "values": {name.replace("_", "-"): text for name, text in values.items()}}
        )

    def step(self, name: str) -> Any:
        """One of the steps."""
        return next(step for step in self.state()["steps"] if step["name"] == name)

    def pairs(self) -> int:
        """How many pairs the run has by now."""
        live = self.state()["live"]
        return 0 if live is None else int(live["pairs"])

    def until_idle(self) -> Any:
        """Wait for the end of what goes on; return the state then."""
        until(lambda: self.state()["activity"] == "idle", "it ends")
        return self.state()


@contextmanager
def page(arguments: list[str], folder: Path, name: str = "page") -> Iterator[tuple[Program, PageClient]]:
    """Run phone-host with a page on a free port while the block lasts."""
    with host(arguments, folder, name, {"XDG_DATA_HOME": str(folder / "data")}) as running:

        def url() -> str:
            found = re.search(r"http://\S+/\?token=\S+", running.out.read_text() + running.stderr)
            return "" if found is None else found[0]

        until(lambda: bool(url()) or running.process.poll() is not None, "the page's address")
        assert url(), running.stderr
        yield running, PageClient(url())
