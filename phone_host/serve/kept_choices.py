"""The page's choices in the settings file: settings as its keys, other options of `run` in the table [page]."""

import fcntl
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from common.errors import SettingsError
from common.files import opened_folder, replacing_in
from common.program.settings import read_file
from common.program.settings_file import Value, changed
from phone_host.declared_settings import PhoneHostSettings
from phone_host.serve.choices import Choices, given_by, options_by_flag, page_options, with_changes
from phone_host.settings import PAGE_TABLE

_SETTINGS: Final = options_by_flag(PhoneHostSettings)
_OF_PROGRAM: Final = tuple(name for name, made in _SETTINGS.items() if not made.page)
"""Settings that concern the program and not the page's choices. They stay as they are."""


def is_there(file: Path) -> bool:
    """Return whether the settings file exists.

    Raises:
        SettingsError: its folder cannot be looked into.
    """
    try:
        return file.exists()
    except OSError as error:
        raise SettingsError(f"{file} cannot be read ({error.strerror})", "name another file with --config") from None


def load_choices(file: Path) -> tuple[dict[str, str], dict[str, str]]:
    """Read the choices.

    Args:
        file: the settings file; it may be missing.

    Returns:
        The choices by option, and the settings that are not the page's likewise.

    Raises:
        SettingsError: it cannot be read, is not TOML, or its table [page] names what is no option.
    """
    if not is_there(file):
        return {}, {}
    content = read_file(file)
    found = {name: _as_words(content[key]) for name, made in _SETTINGS.items() if (key := made.key(name)) in content}
    table = content.get(PAGE_TABLE, {})
    if isinstance(table, dict):
        chosen = {name: value for name, value in table.items() if isinstance(value, str)}
        try:
            found |= with_changes({}, chosen)
        except SettingsError as error:
            raise SettingsError(f"settings file {file}: {error.problem}", f"mend its table [{PAGE_TABLE}]") from None
    others = {name: found[name] for name in _OF_PROGRAM if found.get(name)}
    return {name: value for name, value in found.items() if value and name not in _OF_PROGRAM}, others


def keep(file: Path, choices: Choices, before: Choices | None = None) -> None:
    """Write the choices, whole or not at all. What else the file says stays, with its comments.

    The file is read again under a lock on its folder, and only what differs from `before` is changed in it, so that two pages
    on one file lose nothing of each other. A file that is a link stays one: what it points to is written.

    Args:
        file: the settings file; created with its folder if missing.
        choices: by option.
        before: the choices as whoever writes knew them; None: all that the file says is to be replaced.

    Raises:
        SettingsError: the file is written in a way that cannot be changed, or cannot be written.
    """
    try:
        with suppress(FileNotFoundError):
            file.stat()  # links that go round in a circle end here, in words
        target = file.resolve() if file.is_symlink() else file.absolute()
        with opened_folder(target.parent, make=True) as folder:
            with suppress(OSError):  # network shares and FUSE may have no locks: the file is still replaced whole
                fcntl.flock(folder, fcntl.LOCK_EX)  # until the folder is closed
            text = file.read_text(encoding="utf-8") if is_there(file) else ""
            new = _with_choices(text, choices if before is None else _merged(load_choices(file)[0], before, choices))
            if new == text:
                return
            with replacing_in(folder, target.name, mode=0o600) as writing:  # a camera's address may hold a password
                writing.write(new.encode())
    except OSError as error:
        raise SettingsError(
            f"settings file {file} cannot be written ({error.strerror})", "make room, or name another with --config"
        ) from None


def _merged(current: Choices, before: Choices, after: Choices) -> dict[str, str]:
    """Return what a file says now, changed where two states of one page differ."""
    names = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    return {name: value for name, value in current.items() if name not in names} | {
        name: after[name] for name in names if name in after
    }


def _with_choices(text: str, choices: Choices) -> str:
    """Return the text of a settings file with these choices in place of its own."""
    options = given_by(choices)
    keys: dict[str, Value | None] = {}
    for name, made in page_options(PhoneHostSettings).items():
        key = made.key(name)
        value: Any = options[key] if name in choices else None
        keys[key] = tuple(value) if isinstance(value, list) else value
    others = {name: value for name, value in choices.items() if name not in _SETTINGS}
    return changed(text, keys, PAGE_TABLE, others)


def _as_words(value: object) -> str:
    if isinstance(value, bool):
        return "yes" if value else ""
    return " ".join(map(str, value)) if isinstance(value, list) else str(value)
