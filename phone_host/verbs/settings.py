"""phone-host settings: print each setting with its origin."""

from dataclasses import Field, dataclass, fields, make_dataclass
from pathlib import Path
from typing import Any

from common.program.request import Request, option, part
from common.program.settings import listing
from phone_host.declared_settings import PhoneHostSettings
from phone_host.settings import check, resolve_settings

EXAMPLES = """  phone-host settings
  phone-host settings --config host.toml --tolerance 5
  PHONE_HOST_FIFO=2:block phone-host settings --json
"""


def _given(item: Field[Any]) -> object:
    """Declare the option of a setting; None: it is not given."""
    several, flag = isinstance(item.default, tuple), f"--{item.name.replace('_', '-')}"
    if isinstance(item.default, bool):
        return option(flag, action="store_true", default=None, help=item.metadata["doc"])
    return option(
        flag,
        number=item.metadata["read"],
        type=str if several else type(item.default),
        action="append" if several else "store",
        metavar=item.name.rpartition("_")[2].upper(),
        help=item.metadata["doc"].replace("%", "%%"),
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingsRequest(Request):
    """What settings can be told: each setting."""

    config: Path | None = option("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    settings: object = part(
        make_dataclass("Settings", [(item.name, object, _given(item)) for item in fields(PhoneHostSettings)])
    )


def run(request: SettingsRequest) -> int:
    """Print the settings. Refuse those that `run` would refuse."""
    resolved = resolve_settings(request.given)
    check(resolved.values)
    print(listing(resolved, as_json=request.as_json))
    return 0
