"""Runs board-agent doctor in the guest."""

import json
from typing import Any

from tests.vm.guest import Guest


def doctor(guest: Guest, options: str = "") -> tuple[int, dict[str, Any]]:
    """Run the doctor as root; return the exit code, and the first check of each kind, or the one that failed."""
    shown = guest.sh(f"board-agent doctor --json {options} > /run/doctor.json; echo $?; cat /run/doctor.json")
    code, _, text = shown.partition("\n")
    found: dict[str, Any] = {}
    for check in json.loads(text)["checks"]:
        if check["what"] not in found or check["verdict"] == "fail":
            found[check["what"]] = check
    return int(code), found
