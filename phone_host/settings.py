"""Resolve the host's settings from file, environment and options, and reject those that `run` could not use."""

import math
import os
from collections.abc import Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any, Final

from common.errors import SettingsError
from common.keys import KeyFolder, default_folder
from common.link.factory import parse_link
from common.places import Kind, kind_of
from common.program.settings import DEFAULT, Resolved, log_level, read_file, resolve
from phone_host.camera.factory import check_camera
from phone_host.declared_settings import PRINTERS_TABLE, PhoneHostSettings
from phone_host.stereo.default_matcher import default_matcher
from phone_host.stereo.matcher_names import matcher_named
from phone_host.sync.fifo import FifoSettings

ENVIRONMENT_PREFIX: Final = "PHONE_HOST"

PAGE_TABLE: Final = "page"
"""The table of the settings file in which the page keeps options of `run` that are no settings."""

_NAME: Final = "phone-host.toml"
_ASIDE: Final = (PAGE_TABLE, PRINTERS_TABLE)

_MOST_BUDGET_MS: Final = 60_000
"""The largest photographs take half a minute (docs/depth.md)."""

_MOST_MEGAPIXELS: Final = 1024
"""OpenCV's own limit, 2^30 pixels (CV_IO_MAX_IMAGE_PIXELS)."""


def resolve_settings(given: Mapping[str, Any]) -> Resolved[PhoneHostSettings]:
    """Resolve the settings from file, environment and a verb's options. Options named like a setting are used."""
    options = {item.name: given.get(item.name) for item in fields(PhoneHostSettings)}
    options["link"] = tuple(options["link"]) if options["link"] else None
    resolved = resolve(PhoneHostSettings, ENVIRONMENT_PREFIX, given["config"], options, aside=_ASIDE)
    if matcher_is_given(resolved):
        return resolved
    return replace(resolved, values=replace(resolved.values, matcher=default_matcher().value))


def matcher_is_given(resolved: Resolved[PhoneHostSettings]) -> bool:
    """Return whether a user named the matcher."""
    return dict(resolved.origins)["matcher"] != DEFAULT


def check(settings: PhoneHostSettings) -> None:
    """Reject values that `run` could not use, as far as that can be checked without opening anything.

    Raises:
        SettingsError: a value is invalid.
    """
    log_level(settings.log_level)
    if settings.camera:
        check_camera(settings.camera)
    for uri in settings.link:
        parse_link(uri, listens_by_default=False)
    if doubled := next((uri for uri in settings.link if settings.link.count(uri) > 1), None):
        raise SettingsError(f"link {doubled!r} is given twice", "give each link once")
    FifoSettings.parse(settings.fifo)
    matcher_named(settings.matcher)
    _check_megapixels(settings)
    if settings.align_phase not in {"", "either", "board", "host"}:
        raise SettingsError(f"align_phase is {settings.align_phase!r}", "give either, board or host, or nothing")
    if not (math.isfinite(settings.tolerance) and settings.tolerance >= 0):
        raise SettingsError(f"tolerance is {settings.tolerance:g}", "give 0 or more milliseconds")
    if settings.budget and not 1 <= settings.budget <= _MOST_BUDGET_MS:  # NaN is not
        raise SettingsError(
            f"budget is {settings.budget:g} ms", f"give 1 to {_MOST_BUDGET_MS} ms for each pair, for example 30ms"
        )


def usual_file() -> Path:
    """Return the settings file if no option names another."""
    return default_folder(os.environ, service=False) / _NAME


def printer_keys(file: Path | None) -> tuple[object, Path]:
    """Return the table of printers' keys as the settings file has it, unchecked, and the file. Empty: it has none.

    Args:
        file: settings file; None: the usual one, if it is there.

    Raises:
        SettingsError: it cannot be read, or is not TOML.
    """
    path = file or usual_file()
    if file is None and kind_of(path) is Kind.MISSING:
        return {}, path
    return read_file(path).get(PRINTERS_TABLE, {}), path


def key_folder(keys: str) -> KeyFolder:
    """Return the folder of keys for the setting `keys`.

    Args:
        keys: the setting; empty for the default folder.
    """
    return KeyFolder(Path(keys).expanduser() if keys else default_folder(os.environ, service=False))


def chosen_keys(file: Path | None, option: str | None) -> KeyFolder:
    """Return the folder of keys, for a verb that needs no other setting.

    Args:
        file: settings file, or None.
        option: value of --keys, or None.

    Raises:
        SettingsError: the file or the environment is invalid.
    """
    found = resolve(PhoneHostSettings, ENVIRONMENT_PREFIX, file, {"keys": option}, aside=_ASIDE)
    return key_folder(found.values.keys)


def most_pixels(file: Path | None, option: int | None) -> int:
    """Return the largest accepted image size in pixels, for a verb that needs no other setting.

    Args:
        file: settings file, or None.
        option: value of --max-megapixels, or None.

    Raises:
        SettingsError: a setting is invalid.
    """
    given = {"max_megapixels": option}
    values = resolve(PhoneHostSettings, ENVIRONMENT_PREFIX, file, given, aside=_ASIDE).values
    _check_megapixels(values)
    return values.most_pixels


def _check_megapixels(settings: PhoneHostSettings) -> None:
    if settings.max_megapixels < 1:
        raise SettingsError(f"max_megapixels is {settings.max_megapixels}", "give 1 or more")
    if settings.max_megapixels > _MOST_MEGAPIXELS:
        raise SettingsError(
            f"max_megapixels is more than {_MOST_MEGAPIXELS}", "give less: OpenCV decodes no larger images"
        )
