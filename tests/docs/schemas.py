"""Writes docs/schemas from the classes of results: `python -m tests.docs.schemas`."""

import json
from collections.abc import Mapping
from dataclasses import is_dataclass
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Union, get_args, get_origin

from common.diagnostic import Diagnostic
from phone_host.bench.report import DelayBenchResult
from phone_host.report.calibration_result import CalibrationResult, ImportResult
from phone_host.report.json_result import Absent, types_of
from phone_host.report.quality_json import QualityResult
from phone_host.report.run_json import RunResult
from phone_host.report.scan_json import ScanResult
from phone_host.report.stereo_json import PairResult, SetResult

SCHEMAS: Final = Path(__file__).parents[2] / "docs" / "schemas"
RESULTS: Final[dict[str, type]] = {
    "calibrate": CalibrationResult,
    "calibrate-import": ImportResult,
    "delay-bench": DelayBenchResult,
    "quality": QualityResult,
    "run": RunResult,
    "scan": ScanResult,
    "stereo": SetResult,
    "stereo-pair": PairResult,
}

_PLAIN: Final = {str: "string", Path: "string", int: "integer", float: "number", bool: "boolean", NoneType: "null"}


def text_of(name: str) -> str:
    """Return what the file of a result's schema holds."""
    return json.dumps(json_schema(RESULTS[name]), indent=1) + "\n"


def json_schema(kind: type) -> dict[str, Any]:
    """Return the JSON Schema (draft 2020-12) of a class of results."""
    parts: dict[str, Any] = {}
    whole = _object(kind, parts)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": kind.__name__, **whole, "$defs": parts}


def _object(kind: type, parts: dict[str, Any]) -> dict[str, Any]:
    types = {"problem": str, "remedy": str} if kind is Diagnostic else types_of(kind)
    needed = [name.rstrip("_") for name, hint in types.items() if Absent not in get_args(hint)]
    return {
        "type": "object",
        "description": (kind.__doc__ or "").split("\n")[0],
        "properties": {name.rstrip("_"): _schema(hint, parts) for name, hint in types.items()},
        "required": needed,
        "additionalProperties": False,
    }


def _schema(hint: Any, parts: dict[str, Any]) -> dict[str, Any]:
    origin, inner = get_origin(hint), get_args(hint)
    if origin is Annotated:
        return _schema(inner[0], parts)
    if origin in {Union, UnionType}:
        return _one_of([_schema(each, parts) for each in inner if each is not Absent])
    if origin is tuple:
        return {"type": "array", "items": _schema(inner[0], parts)}
    if origin is Mapping:
        return {"type": "object", "additionalProperties": _schema(inner[1], parts)}
    if isinstance(hint, type) and is_dataclass(hint):
        if hint.__name__ not in parts:
            parts[hint.__name__] = {}  # it may hold itself
            parts[hint.__name__] = _object(hint, parts)
        return {"$ref": f"#/$defs/{hint.__name__}"}
    return {"type": _PLAIN[hint]} if hint in _PLAIN else {"enum": [each.value for each in hint]}


def _one_of(kinds: list[dict[str, Any]]) -> dict[str, Any]:
    if all(list(kind) == ["type"] for kind in kinds):
        return {"type": kinds[0]["type"] if len(kinds) == 1 else [kind["type"] for kind in kinds]}
    return kinds[0] if len(kinds) == 1 else {"anyOf": kinds}


if __name__ == "__main__":
    for result in RESULTS:
        (SCHEMAS / f"{result}.schema.json").write_text(text_of(result), encoding="utf-8")
