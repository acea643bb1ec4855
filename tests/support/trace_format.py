"""The rules of the "Trace Event Format" (Google, document linked from catapult's docs/trace-event-format.md) for the phases that we write."""

import json
from itertools import pairwise
from typing import Any

METADATA = {"process_name", "process_sort_index", "thread_name", "thread_sort_index"}


def checked(text: str) -> list[dict[str, Any]]:
    """All events of a trace in the JSON object form; fails if one breaks a rule."""
    trace = json.loads(text)
    assert set(trace) >= {"traceEvents"}
    assert trace.get("displayTimeUnit", "ms") in {"ms", "ns"}
    events: list[dict[str, Any]] = trace["traceEvents"]
    named = {(event["pid"], event["tid"]) for event in events if event["name"] == "thread_name"}
    for event in events:
        assert isinstance(event["name"], str)
        assert isinstance(event["pid"], int)
        assert isinstance(event["tid"], int)
        assert isinstance(event["ts"], int | float)
        match event["ph"]:
            case "X":
                assert event["dur"] >= 0
                assert isinstance(event["args"], dict)
                assert (event["pid"], event["tid"]) in named
            case "M":
                assert event["name"] in METADATA
                assert set(event["args"]) == {"sort_index" if event["name"].endswith("sort_index") else "name"}
            case "s" | "f":
                assert "id" in event
                assert isinstance(event["cat"], str)
            case other:
                raise AssertionError(f"a phase that we do not write: {other}")
    check_order(events)
    check_nesting(events)
    check_flows(events)
    return events


def check_order(events: list[dict[str, Any]]) -> None:
    """Names come first, once per process and thread, and every process with events has one; then all events in order of time."""
    names = [event for event in events if event["ph"] == "M"]
    shown = events[len(names) :]
    assert all(event["ph"] != "M" for event in shown)
    said = [(event["name"], event["pid"], event["tid"]) for event in names]
    assert len(said) == len(set(said))
    assert {event["pid"] for event in shown} <= {pid for name, pid, _ in said if name == "process_name"}
    assert all(before["ts"] <= after["ts"] for before, after in pairwise(shown))


def check_nesting(events: list[dict[str, Any]]) -> None:
    """Slices of one thread are disjoint or nested, to 1 ns, the resolution of the output."""
    threads: dict[tuple[int, int], list[tuple[float, float]]] = {}
    for event in events:
        if event["ph"] == "X":
            threads.setdefault((event["pid"], event["tid"]), []).append((event["ts"], event["ts"] + event["dur"]))
    for slices in threads.values():
        open_ends: list[float] = []
        for begin, end in sorted(slices, key=lambda one: (one[0], -one[1])):
            while open_ends and open_ends[-1] <= begin + 0.001:
                open_ends.pop()
            assert not open_ends or end <= open_ends[-1] + 0.001, (
                f"a slice ends at {end}, its encloser at {open_ends[-1]}"
            )
            open_ends.append(end)


def check_flows(events: list[dict[str, Any]]) -> None:
    """Each flow begins once and ends once, later, both bound to a slice present at that moment: a flow's place is its enclosing slice."""
    flows: dict[tuple[str, str, int], list[dict[str, Any]]] = {}
    places = {(event["pid"], event["tid"], event["ts"]) for event in events if event["ph"] == "X"}
    for event in events:
        if event["ph"] in {"s", "f"}:
            flows.setdefault((event["cat"], event["name"], event["id"]), []).append(event)
            assert (event["pid"], event["tid"], event["ts"]) in places
    for ends in flows.values():
        assert [end["ph"] for end in ends] == ["s", "f"]
        assert ends[1]["bp"] == "e"  # otherwise it would bind to the next slice, not to the enclosing one
        assert all(one["ts"] <= other["ts"] for one, other in pairwise(ends))
