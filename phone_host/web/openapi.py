"""Describes the HTTP API for programs, as OpenAPI 3.1. Pure."""

from collections.abc import Mapping
from typing import Final

from common.versions import PACKAGE_VERSION
from phone_host.output.pair_files import RUN_FILES
from phone_host.web.saved_pairs import SAVED_MODEL, SCAN_FILES
from phone_host.web.source import Activity, Do, PrintStage, StepName
from phone_host.web.wishes import MOST_NUMBER, MOST_POINTS, MOST_PX, MOST_TEXT, MOST_VALUES

_Json = dict[str, object]

_TEXT: Final[_Json] = {"type": "string"}
_NUMBER: Final[_Json] = {"type": ["number", "null"]}
_POINT: Final[_Json] = {
    "type": "array",
    "items": {"type": "number", "minimum": -MOST_PX, "maximum": MOST_PX},
    "minItems": 2,
    "maxItems": 2,
}
_WHOLE: Final[_Json] = {"type": "integer", "minimum": 0, "maximum": MOST_NUMBER}

_REFUSED: Final = (401, 403, 421, 429)
"""What any request may be answered: no token, another site, another name, too often."""


_DO: Final = (
    "`record` begins a recording (MCAP) beside the run that goes on, in a new file of the folder `recordings`; `end_recording` ends it."
    " How it goes stands in the state: `live.recording`. `snapshot` saves the newest pair. `set`, `calibrate` and `scan` take as values the options"
    " that the schemas `set_values`, `calibrate_values` and `scan_values` list (switches: yes or no), `enrol` link and code, `crop` box, `check_model` bed,"
    " `save_model` format, `prepare_print` printer and bed, `print` confirm: what `printing.asks` says; the others take none."
)


def description(values: Mapping[str, object]) -> _Json:
    """Return the description.

    Args:
        values: schemas of what commands take, by name.
    """
    return {
        "openapi": "3.1.0",
        "info": {
            "title": "tandemscan",
            "version": PACKAGE_VERSION,
            "description": "What the page shows, for programs. On loopback reading needs no token.",
        },
        "paths": {
            "/api/state": _get("The program's state, as the page gets it", _json("State")),
            "/api/events": _get(
                "The state each time it changes, as server-sent events `state`", _bytes("text/event-stream"), 503
            ),
            "/api/report.json": _get("report.json of the run, up to now", _json("Report"), 404),
            "/api/left.jpg": _newest("Rectified left image", "image/jpeg"),
            "/api/right.jpg": _newest("Rectified right image", "image/jpeg"),
            "/api/disparity.png": _newest("Disparity in colours with its scale", "image/png"),
            "/api/cloud.ply": _newest("Points in metres, with colours", "application/octet-stream"),
            "/api/pairs": _get("The saved pairs", _json("Pairs"), 503),
            "/api/pairs/{number}/{file}": _saved(),
            "/api/surface": _surface(),
            "/api/scan/{file}": _scanned(),
            "/api/openapi.json": _get("This description", _json("Report")),
            "/api/authority.pem": _get(
                "Certificate of the page's own authority", _bytes("application/x-x509-ca-cert"), 404
            ),
            "/api/command": _post("Do something, as the page's buttons do", "Command", "Done", 409, 503),
            "/api/measure": _post("Measure one or two points of the rectified left image", "Points", "Measured"),
        },
        "components": {
            "schemas": {**_schemas(), **values},
            "securitySchemes": {
                "token": {"type": "http", "scheme": "bearer"},
                "cookie": {"type": "apiKey", "in": "cookie", "name": "tandemscan"},
            },
        },
        "security": [{}, {"token": []}, {"cookie": []}],
    }


def _schemas() -> _Json:
    choice = _object(uri=_TEXT, name=_TEXT, note=_TEXT)
    choices = {"type": ["array", "null"], "items": choice}
    step = _object(name={"enum": [each.value for each in StepName]}, done={"type": "boolean"}, words=_TEXT)
    places = {
        "type": "array",
        "items": {"type": ["array", "null"], "items": {"type": "number"}, "minItems": 3, "maxItems": 3},
    }
    numbers = {"type": "array", "items": _NUMBER}
    scan = _object(
        words=_TEXT,
        level={"enum": ["good", "warning", "bad", "unknown"]},
        pairs=_WHOLE,
        fused=_WHOLE,
        folder=_TEXT,
        files={"type": "array", "items": _TEXT},
        options={"type": "object", "additionalProperties": _TEXT},
    )
    printing = _object(
        stage={"enum": [each.value for each in PrintStage]},
        words=_TEXT,
        level={"enum": ["good", "warning", "bad", "unknown"]},
        share=_NUMBER,
        asks=_TEXT,
    )
    state = _object(
        kind={"const": "state"},
        activity={"enum": [each.value for each in Activity]},
        steps={"type": "array", "items": step},
        command=_TEXT,
        scan_command=_TEXT,
        settings={"type": "object", "additionalProperties": _TEXT},
        boards=choices,
        cameras=choices,
        stranger=_TEXT,
        matchers={"type": "array", "items": _TEXT},
        guide={"type": ["object", "null"]},
        scan={"anyOf": [scan, {"type": "null"}]},
        printing={"anyOf": [printing, {"type": "null"}]},
        trouble={"anyOf": [_ref("Problem"), {"type": "null"}]},
        changed=_WHOLE,
        begun=_WHOLE,
        live={"type": ["object", "null"]},
        report={"type": ["object", "null"]},
    )
    pair = _object(number=_WHOLE, files={"type": "array", "items": {"enum": [file.value for file in RUN_FILES]}})
    text = {"type": "string", "maxLength": MOST_TEXT, "description": "without control characters"}
    values = {"type": "object", "additionalProperties": text, "maxProperties": MOST_VALUES}
    points = {"type": "array", "items": _POINT, "minItems": 1, "maxItems": MOST_POINTS}
    number = {"anyOf": [_WHOLE, {"type": "null"}]}
    return {
        "State": state,
        "Report": {"type": "object"},
        "Problem": _object(problem=_TEXT, remedy=_TEXT),
        "Pairs": _object(pairs={"type": "array", "items": pair}),
        "Command": _object(("do",), do={"enum": [each.value for each in Do], "description": _DO}, values=values)
        | {"additionalProperties": False},
        "Done": _object(words=_TEXT),
        "Points": _object(("points",), points=points, number=number) | {"additionalProperties": False},
        "Measured": _object(
            places_m=places,
            place_sigmas_m=numbers,
            distances_m=numbers,
            length_m=_NUMBER,
            length_sigma_m=_NUMBER,
            words=_TEXT,
        ),
    }


def _object(required: tuple[str, ...] | None = None, /, **properties: object) -> _Json:
    needed = list(properties) if required is None else list(required)
    return {"type": "object", "properties": properties, "required": needed}


def _ref(name: str) -> _Json:
    return {"$ref": f"#/components/schemas/{name}"}


def _json(name: str) -> _Json:
    return {"application/json": {"schema": _ref(name)}}


def _bytes(kind: str) -> _Json:
    return {kind: {"schema": {"type": "string", "format": "binary"}}}


def _answers(content: _Json, *statuses: int) -> _Json:
    problem = {"description": "What is wrong, and what to do", "content": _json("Problem")}
    return {
        "200": {"description": "Done", "content": content},
        **{str(status): problem for status in (*_REFUSED, *statuses)},
    }


def _get(summary: str, content: _Json, *statuses: int) -> _Json:
    return {"get": {"summary": summary, "responses": _answers(content, *statuses)}}


def _newest(summary: str, kind: str) -> _Json:
    return _get(f"{summary}, of the newest pair", _bytes(kind), 404, 503)


def _saved() -> _Json:
    content = {**_bytes("image/png"), **_bytes("application/octet-stream")}
    described = _get("A file of a saved pair", content, 404, 503)
    number = {"name": "number", "in": "path", "required": True, "schema": _WHOLE | {"maximum": 999_999_999}}
    file = {"name": "file", "in": "path", "required": True, "schema": {"enum": [each.value for each in RUN_FILES]}}
    return described | {"parameters": [number, file]}


def _surface() -> _Json:
    described = _get(
        "What of the scan's surface is new, as triangles; docs/page.md describes the bytes",
        _bytes("application/octet-stream"),
        400,
        404,
        503,
    )
    since = {
        "name": "since",
        "in": "query",
        "required": False,
        "description": "`newest` of the last answer; 0: everything",
        "schema": _WHOLE,
    }
    return described | {"parameters": [since]}


def _scanned() -> _Json:
    described = _get("A file of the last scan", _bytes("application/octet-stream"), 404, 503)
    file = {
        "name": "file",
        "in": "path",
        "required": True,
        "schema": {"anyOf": [{"enum": list(SCAN_FILES)}, {"type": "string", "pattern": f"^{SAVED_MODEL}$"}]},
    }
    return described | {"parameters": [file]}


def _post(summary: str, body: str, answer: str, *statuses: int) -> _Json:
    return {
        "post": {
            "summary": summary,
            "security": [{"token": []}],
            "requestBody": {"required": True, "content": _json(body)},
            "responses": _answers(_json(answer), 400, 408, 413, *statuses),
        }
    }
