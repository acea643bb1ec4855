"""The site's page of messages, made from the code when `make docs` builds the site (see `site.py`).

It searches the syntax trees of the three packages for every place that raises one of our errors or makes a concern
about a run, so that none can be missing.
"""

import ast
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from tests.docs.message_texts import Code, Place, called

_ROOT: Final = Path(__file__).parents[2]

_ROOMS: Final = (
    (
        "Options, settings and addresses",
        (
            "common/program",
            "phone_host/settings",
            "phone_host/jobs",
            "phone_host/verbs",
            "board_agent/settings",
            "board_agent/verbs",
            "phone_host/sync",
            "phone_host/api",
        ),
    ),
    ("Cameras", ("common/camera", "phone_host/camera", "board_agent/rate")),
    ("Links", ("common/link", "phone_host/stream", "phone_host/run/course", "phone_host/subprocesses")),
    (
        "Finding a board, keys and enrolment",
        ("phone_host/discovery", "common/keys", "board_agent/enrolment", "common/protocol", "common/trusted"),
    ),
    ("Calibration and rig.yaml", ("phone_host/calibration", "phone_host/output/rig")),
    ("Images and depth", ("phone_host/stereo", "common/image", "phone_host/scene")),
    (
        "Files and folders",
        ("common/files", "phone_host/output", "phone_host/recording", "phone_host/run", "phone_host/report"),
    ),
    ("Everything else", ("",)),
)

_INTRO: Final = """# Troubleshooting

Every error is one line: what is wrong, then what to do. This page lists them with their remedies, in the words of the programs. Words in CAPITALS stand
for names and numbers of your case. The page is made from the code. Mistyped verbs and options are not listed: the message names them, and `--help` lists
the right ones.

## First things to try

| what you see | what to do |
|---|---|
| anything about the board | `sudo board-agent doctor` on the board: one line per check, with the remedy |
| anything about the host | `phone-host doctor --link … --camera … --calibration rig.yaml` |
| a setting has no effect | `phone-host settings` or `board-agent settings`: each value with its origin |
| an error that you do not understand | the same command with `--debug`; `run` also takes `--log-level debug` |

## Exit codes

| code | meaning |
|---|---|
| 0 | done |
| 2 | wrong usage or settings; nothing was started |
| 3 | a device, link or folder cannot be had now; trying again may help |
| 4 | the data are bad or missing, or a check failed |
| 130 | ended by Ctrl-C; a print that was cancelled, by whatever but a closed terminal |
| 129, 131, 143 | a computation was ended by SIGHUP (its terminal was closed, ssh was lost), SIGQUIT or SIGTERM; streams and daemons end in order then, with 0. `nohup` keeps them alive |
"""

_CONCERNS: Final = """
## Doubts about a run

The summary, the page and `report.json` of a run name each reason why its depth may be wrong.

| doubt | what it says | what to do |
|---|---|---|
"""


def packages() -> list[Path]:
    """Every module of the product."""
    return sorted(path for name in ("common", "board_agent", "phone_host") for path in (_ROOT / name).rglob("*.py"))


def unresolved(code: Code) -> list[str]:
    """Places whose message cannot be determined from the code, as `path:line`."""
    return [
        f"{place.path.relative_to(_ROOT)}:{place.call.lineno}"
        for place, problems, remedies in messages(code)
        if not problems or not remedies
    ]


def messages(code: Code) -> Iterator[tuple[Place, list[str], list[str]]]:
    """Every place that makes an error, with the possible texts of its problem and its remedy."""
    for place in code.calls(list(code.errors)):
        match place.call.args:
            case [ast.Attribute(attr="problem" | "message"), _]:
                continue  # rewords another of our errors or diagnostics, which is listed where it is made
            case [ast.Starred(value=ast.Call() as pair)]:
                for problem, remedy in code.returned(called(pair)):
                    yield place, code.texts(place, problem), code.texts(place, remedy)
            case [problem, remedy] | [_, problem, remedy]:  # a spoiled image's error begins with its fault
                yield place, code.texts(place, problem), code.texts(place, remedy)
            case _:
                yield place, [], []


def page(code: Code) -> str:
    """The page's text."""
    rooms: dict[str, list[str]] = {room: [] for room, _ in _ROOMS}
    for place, problems, remedies in messages(code):
        where = str(place.path.relative_to(_ROOT))
        room = next(room for room, folders in _ROOMS if where.startswith(folders))
        for problem in problems:
            row = f"| {_cell(problem)} | {_cell(' / '.join(remedies))} | {code.errors[called(place.call)]} |"
            if row not in rooms[room]:
                rooms[room].append(row)
    parts = [_INTRO]
    for room, rows in rooms.items():
        if rows:
            parts += [
                f"\n## {room}\n\n| message | what to do | exit |\n|---|---|---|\n",
                *(f"{row}\n" for row in sorted(rows)),
            ]
    parts.append(_CONCERNS)
    for place in code.calls(["diagnose", "_stamp_doubt"]):
        kind, message, remedy = place.call.args[:3]
        name = kind.attr if isinstance(kind, ast.Attribute) and kind.attr.isupper() else ""
        if name == "STAMPS":
            continue  # one by one, as _stamp_doubt
        usual = "stamps" if called(place.call) == "_stamp_doubt" else "images apart"
        name = name.lower().replace("_", " ") or usual
        helps = _cell(" / ".join(code.texts(place, remedy)))
        rows_of_code = [f"| {name} | {_cell(text)} | {helps} |\n" for text in code.texts(place, message) if text]
        parts += [row for row in rows_of_code if row not in parts]
    return "".join(parts)


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("<", "&lt;").replace("\n", " ").replace("*", "\\*").replace("__", "\\_\\_")
