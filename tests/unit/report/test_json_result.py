"""Results as JSON: keys and their order are the fields', the schemas in docs/schemas are those of the classes, and the values fit them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import Path
from typing import Any

import pytest

from common.diagnostic import Diagnostic
from common.errors import DataError
from phone_host.bench.report import as_json
from phone_host.calibration.solve.verdict import Assessment
from phone_host.model import Drift, MatchReport, Verdict
from phone_host.output.json_text import json_text, json_value
from phone_host.output.rig_files.imported import Imported, RigKind
from phone_host.report.calibration_report import ImportReport, Judged
from phone_host.report.calibration_result import calibration_values, import_values
from phone_host.report.json_result import ABSENT, D2, Absent, json_values
from phone_host.report.quality_json import quality_json
from phone_host.report.run_json import build
from phone_host.report.stereo_json import pair_json, set_json
from phone_host.report.stereo_report import FailedPair, SetReport
from tests.docs.schemas import RESULTS, SCHEMAS, json_schema, text_of
from tests.support import quality_pages, run_snapshots
from tests.support.bench_results import UNDER, analysed, result, slower
from tests.support.calibration_series import calibration, calibration_report
from tests.support.rigs import unlike_rig
from tests.unit.diagnostics.test_drift_words import KNOCK
from tests.unit.report.test_report_keys import eventful_run
from tests.unit.report.test_stereo_report import BAD, PAIR

KINDS: dict[str, Any] = {
    "string": str,
    "integer": int,
    "number": int | float,
    "boolean": bool,
    "null": type(None),
    "array": list,
    "object": dict,
}


class Colour(Enum):
    RED = "red"


@dataclass(frozen=True)
class Part:
    """A part."""

    size_mm: D2


@dataclass(frozen=True)
class Whole:
    """A whole.

    Longer words are not told.
    """

    from_: Path
    colour: Colour
    parts: tuple[Part, ...]
    by_name: Mapping[str, D2 | None]
    note: str | Absent = ABSENT
    exact: float | None = None


def problems(value: Any, schema: Mapping[str, Any], parts: Mapping[str, Any]) -> list[str]:
    """Return where a value breaks a schema, as far as `json_schema` uses the language."""
    if "$ref" in schema:
        return problems(value, parts[schema["$ref"].rpartition("/")[2]], parts)
    if "anyOf" in schema or isinstance(schema.get("type"), list):
        choices = schema.get("anyOf") or [{"type": kind} for kind in schema["type"]]
        tried = [problems(value, one, parts) for one in choices]
        return [] if [] in tried else tried[0]
    if "enum" in schema:
        return [] if value in schema["enum"] else [f"{value!r} is none of {schema['enum']}"]
    if not isinstance(value, KINDS[schema["type"]]) or (isinstance(value, float) and not math.isfinite(value)):
        return [f"{value!r} is no {schema['type']}"]
    if schema["type"] != "object":
        inner = schema.get("items", {})
        return [each for one in (value if inner else ()) for each in problems(one, inner, parts)]
    known = schema.get("properties", {})
    found = [f"{key} is missing" for key in schema.get("required", ()) if key not in value]
    for key, one in value.items():
        inner = known.get(key, schema["additionalProperties"])
        found += problems(one, inner, parts) if inner else [f"{key} is too much"]
    return found


def test_a_result_becomes_an_object() -> None:
    """Keys in the order of the fields, rounded numbers, no key for what is absent; NaN is null where numbers are rounded."""
    whole = Whole(Path("a/b"), Colour.RED, (Part(1.006),), {"x": math.nan, "y": 2.0})
    assert list(json_values(whole).items()) == [
        ("from", "a/b"),
        ("colour", "red"),
        ("parts", [{"size_mm": 1.01}]),
        ("by_name", {"x": None, "y": 2.0}),
        ("exact", None),
    ]
    assert json_values(replace(whole, note="n", exact=0.123456789))["exact"] == 0.123456789


def test_a_class_becomes_a_schema() -> None:
    """A field that may be absent is not required; the first line of a class says what it is."""
    schema = json_schema(Whole)
    assert schema["required"] == ["from", "colour", "parts", "by_name", "exact"]
    assert (schema["description"], schema["$defs"]["Part"]["properties"]) == (
        "A whole.",
        {"size_mm": {"type": "number"}},
    )
    assert schema["properties"]["colour"] == {"enum": ["red"]}
    assert schema["properties"]["note"] == {"type": "string"}
    values = json_values(Whole(Path("a"), Colour.RED, (), {}))
    assert problems(values, schema, schema["$defs"]) == []
    assert problems({**values, "colour": 1, "more": 2}, schema, schema["$defs"]) == [
        "1 is none of ['red']",
        "more is too much",
    ]
    del values["by_name"]
    assert problems(values, schema, schema["$defs"]) == ["by_name is missing"]


@pytest.mark.parametrize("name", sorted(RESULTS))
def test_the_documented_schema_is_the_classs(name: str) -> None:
    """Otherwise: python -m tests.docs.schemas."""
    assert (SCHEMAS / f"{name}.schema.json").read_text(encoding="utf-8") == text_of(name)


def test_reports_fit_their_schemas() -> None:
    """Calibrations with and without a rig, an imported one, benchmarks with and without pairs, pairs with all figures and with few."""
    judged = Judged(calibration(), Assessment(Verdict.USABLE, "take more"))
    imported = ImportReport(imported=Imported(rig=unlike_rig(), kind=RigKind.ROS, files=(), notes=()))
    runs = (result(), slower("serial", 2.0), slower("rfcomm", 1.5))
    nothing = replace(result(), ledgers=())
    torn = FailedPair(name="p", left="l", right="r", failure=Diagnostic("bad", "mend"))
    few = replace(PAIR, trust=BAD, match_report=MatchReport(), search=None, geometry=None, limits=None, cut=None)
    for name, values in (
        ("calibrate", calibration_values(calibration_report(judged))),
        ("calibrate", calibration_values(calibration_report(DataError("nothing is seen", "light it")))),
        ("calibrate-import", import_values(imported)),
        ("delay-bench", as_json(runs, UNDER, analysed(*runs))),
        ("delay-bench", as_json([nothing], UNDER, analysed(nothing))),
        ("run", build(eventful_run())),
        ("run", build(run_snapshots.run(31))),
        ("quality", quality_json(quality_pages.report(failed=True))),
        ("stereo-pair", pair_json(PAIR)),
        ("stereo-pair", pair_json(few)),
        ("stereo", set_json(SetReport(pairs=(PAIR, torn), by_number=True))),
        ("stereo", set_json(SetReport(pairs=(few,), by_number=False, drift=Drift(changes=(KNOCK,))))),
    ):
        schema = json_schema(RESULTS[name])
        assert problems(json_value(json_text(values)), schema, schema["$defs"]) == []
