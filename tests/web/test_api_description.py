"""The HTTP API does what its description says, whatever is sent: schemathesis makes the requests.

`make fuzz TARGETS=page` makes many more of them: EXAMPLES in the environment.
"""

import os
from collections.abc import Iterator
from typing import Any

import pytest
import schemathesis
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis import Case, GenerationMode
from schemathesis.core.result import Ok
from schemathesis.specs.openapi import checks

from phone_host.output.pair_files import RUN_FILES, write_pair
from phone_host.web.openapi import description
from phone_host.web.server import PageServer
from phone_host.web.settings import Limits, PageSettings
from tests.support.page_source import PageSource, page_folder
from tests.support.stereo_pages import processed

EXAMPLES = int(os.environ.get("EXAMPLES", "15"))

# Event streams never end: tests/system/test_page_server.py reads them.
SCHEMA = schemathesis.openapi.from_dict(description({})).exclude(path="/api/events")
OPERATIONS = {found.ok().label: found.ok() for found in SCHEMA.get_all_operations() if isinstance(found, Ok)}

WITH_INPUT = [label for label, operation in OPERATIONS.items() if "{" in label or operation.method == "post"]

# Other methods, and requests without a token: tests/system/test_page_server.py. What is refused: tests/unit/web/test_page_wishes.py, which knows
# more than a schema says (control characters).
LEFT_OUT = [
    checks.unsupported_method,
    checks.ignored_auth,
    checks.negative_data_rejection,
    checks.positive_data_acceptance,
]

MANY = settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck), phases=(Phase.generate,))


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[PageServer]:
    """A server with a run, a newest pair and a saved one, and without a limit of rate."""
    folder = tmp_path_factory.mktemp("page")
    pair = folder / "saved" / "pair-000000"
    pair.mkdir(parents=True)
    write_pair(pair, processed(), RUN_FILES)
    source = PageSource(saved=str(folder / "saved"))
    source.start_run(4)
    source.show()
    settings_ = PageSettings(port=0, page=page_folder(folder / "page"))
    served = PageServer(source, settings_, Limits(requests_per_s=1e6, requests_burst=10**9))
    served.start()
    yield served
    served.stop()


def test_the_server_tells_its_description(server: PageServer) -> None:
    """What a program loads is what is tested here."""
    told = schemathesis.openapi.from_url(f"{server.address}api/openapi.json")
    assert told.raw_schema == description({})


@pytest.mark.parametrize("label", OPERATIONS)
def test_the_api_is_as_described(server: PageServer, label: str) -> None:
    """With the token, asked as described: every status, type and body is one that is described; nothing fails inside."""
    ask(server, label, GenerationMode.POSITIVE)


@pytest.mark.parametrize("label", WITH_INPUT)
def test_nothing_fails_inside(server: PageServer, label: str) -> None:
    """Asked otherwise than described: an answer that is described."""
    ask(server, label, GenerationMode.NEGATIVE)


def ask(server: PageServer, label: str, mode: GenerationMode) -> None:
    """Ask many times, with the token."""
    headers = {"Authorization": f"Bearer {server.token}"}

    @given(case=OPERATIONS[label].as_strategy(generation_mode=mode))
    @MANY
    def asked(case: Case[Any]) -> None:
        case.call_and_validate(server.address.rstrip("/"), headers=headers, excluded_checks=LEFT_OUT)

    asked()


@pytest.mark.parametrize("label", [label for label in OPERATIONS if label.startswith("POST")])
def test_no_command_without_the_token(server: PageServer, label: str) -> None:
    """Whatever is sent, without the token it is refused before it is read."""

    @given(case=OPERATIONS[label].as_strategy())
    @MANY
    def asked(case: Case[Any]) -> None:
        assert case.call(base_url=server.address.rstrip("/")).status_code == 401

    asked()
