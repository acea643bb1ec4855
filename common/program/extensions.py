"""Finds implementations by name: our own, and those that installed packages register as entry points.

Rules: only registries of implementations import this module. An implementation is imported when its name is asked for, not before. Entry
points are searched only if a name is not ours, so a start that needs none does not pay for the search.

A package registers in its pyproject.toml, for example:

    [project.entry-points."tandemscan.links"]
    quic = "my_package.link:open_link"

The value is a callable that makes the implementation. Each registry states its arguments and what it must return.
"""

import importlib
import inspect
from typing import TYPE_CHECKING, Any

from common.errors import SettingsError, TandemError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint


def named(reference: str) -> Any:  # noqa: ANN401 - whatever has that name
    """Import one of our own implementations.

    Args:
        reference: `package.module:name`.

    Raises:
        ImportError: a package that it needs is missing.
    """
    module, _, name = reference.partition(":")
    return getattr(importlib.import_module(module), name)


def registered_names(group: str) -> tuple[str, ...]:
    """Return the names that installed packages register, in alphabetical order.

    Args:
        group: entry point group, for example `tandemscan.links`.
    """
    return tuple(sorted({point.name for point in _entry_points(group)}))


def make_registered(group: str, name: str, kind: type, *arguments: object) -> Any:  # noqa: ANN401 - a `kind`, which is a protocol
    """Call what an installed package registers under a name, and return the implementation it makes.

    Args:
        group: entry point group.
        name: one of `registered_names`.
        kind: the protocol that the result must implement.
        arguments: arguments of the registered callable.

    Returns:
        The implementation; it has every member of the protocol.

    Raises:
        SettingsError: the name is not registered, several packages claim it, or the implementation cannot be loaded or does not fit.
        TandemError: as raised by the package itself.
    """
    point = _only(group, name)
    where = f"{name!r} of {group} ({point.value})"
    remedy = "mend or uninstall the package that registers it"
    try:
        make = point.load()
    except Exception as error:
        raise SettingsError(f"{where} cannot be loaded ({type(error).__name__}: {error})", remedy) from error
    _require_call(make, arguments, where)
    try:
        made = make(*arguments)
    except TandemError:
        raise
    except Exception as error:
        raise SettingsError(f"{where} failed ({type(error).__name__}: {error})", remedy) from error
    if missing := sorted(member for member in _members(kind) if not _has(made, member)):
        raise SettingsError(f"{where} gave no {kind.__name__}: it has no {', '.join(missing)}", remedy)
    return made


def _only(group: str, name: str) -> "EntryPoint":
    found = {point.value: point for point in _entry_points(group) if point.name == name}
    if not found:
        raise SettingsError(f"no installed package registers {name!r} as one of {group}", "install it")
    if len(found) > 1:
        raise SettingsError(f"{name!r} of {group} is registered by {' and by '.join(sorted(found))}", "uninstall one")
    return next(iter(found.values()))


def _entry_points(group: str) -> "tuple[EntryPoint, ...]":
    from importlib.metadata import entry_points  # noqa: PLC0415 - 30 ms of a host's start, more on a board; rarely needed

    return tuple(entry_points(group=group))


def _require_call(make: Any, arguments: tuple[object, ...], where: str) -> None:  # noqa: ANN401 - whatever was registered
    if not callable(make):
        raise SettingsError(f"{where} is no callable", "mend or uninstall the package that registers it")
    try:
        inspect.signature(make).bind(*arguments)
    except TypeError as error:
        given = ", ".join(type(argument).__name__ for argument in arguments)
        raise SettingsError(f"{where} cannot be called with ({given}): {error}", "see its registry's rules") from None
    except ValueError:  # a callable without a known signature is simply tried
        return


def _members(protocol: type) -> set[str]:
    return {name for name in vars(protocol) if not name.startswith("_")}


def _has(made: object, member: str) -> bool:
    try:
        inspect.getattr_static(made, member)
    except AttributeError:
        return False
    return True
