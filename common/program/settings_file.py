"""Changes single keys of a settings file and leaves the rest as its owner wrote it: comments, order, other keys. Pure.

A changed line loses the comment behind its value. The result is read again: what would not mean what was asked for is refused.
"""

import json
import re
import tomllib
from collections.abc import Mapping
from typing import Any, Final

from common.errors import SettingsError

Value = str | bool | int | float | tuple[str, ...]

_TABLE: Final = re.compile(r"\s*\[")


def changed(text: str, keys: Mapping[str, Value | None], table: str, content: Mapping[str, str]) -> str:
    """Change keys before the first table, and write one table anew.

    Args:
        text: the file; empty: there is none yet.
        keys: values by key; None takes the key out.
        table: name of the table.
        content: what it shall hold; nothing: the table is taken out.

    Raises:
        SettingsError: the file is written in a way that this cannot change.
    """
    wanted = _meaning(text)
    wanted.pop(table, None)
    for key, value in keys.items():
        wanted.pop(key, None)
        if value is not None:
            wanted[key] = list(value) if isinstance(value, tuple) else value
    if content:
        wanted[table] = dict(content)
    lines = _without_table(text.splitlines(), table)
    first = next((at for at, line in enumerate(lines) if _TABLE.match(line)), len(lines))
    head, tail = _trimmed(lines[:first]), _trimmed(lines[first:])
    for key, value in keys.items():
        head = _with_key(head, key, value)
    own = [f"[{table}]", *(f"{_key(name)} = {_text(value)}" for name, value in content.items())] if content else []
    made = "\n\n".join("\n".join(part) for part in (head, tail, own) if part) + "\n"
    if _meaning(made) != wanted:
        raise SettingsError("the settings file is written in a way that cannot be changed here", "edit it by hand")
    return made


def _meaning(text: str) -> dict[str, Any]:
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise SettingsError(f"the settings file is not TOML ({error})", "mend it by hand") from None


def _without_table(lines: list[str], table: str) -> list[str]:
    begin = next((at for at, line in enumerate(lines) if line.strip() == f"[{table}]"), None)
    if begin is None:
        return lines
    end = next((at for at in range(begin + 1, len(lines)) if _TABLE.match(lines[at])), len(lines))
    return lines[:begin] + lines[end:]


def _trimmed(lines: list[str]) -> list[str]:
    """Return lines without the empty ones at their end."""
    while lines and not lines[-1].strip():
        lines = lines[:-1]
    return lines


def _with_key(lines: list[str], key: str, value: Value | None) -> list[str]:
    """Put a key's line where the key stood, which may have taken several lines; else at the end."""
    new = [] if value is None else [f"{key} = {_text(value)}"]
    begin = next((at for at, line in enumerate(lines) if re.match(rf"\s*{re.escape(key)}\s*=", line)), None)
    if begin is None:
        return [*lines, *new]
    end = next(at for at in range(begin + 1, len(lines) + 1) if at == len(lines) or _is_whole(lines[begin:at]))
    return lines[:begin] + new + lines[end:]


def _is_whole(lines: list[str]) -> bool:
    try:
        tomllib.loads("\n".join(lines))
    except tomllib.TOMLDecodeError:
        return False
    return True


def _key(name: str) -> str:
    return name if re.fullmatch(r"[A-Za-z0-9_-]+", name) else _text(name)


def _text(value: Value) -> str:
    """Return a value as TOML: its strings are JSON's, save for what JSON leaves unescaped (TOML 1.0, string)."""
    if isinstance(value, tuple):
        return f"[{', '.join(_text(item) for item in value)}]"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    return json.dumps(value)
