"""phone-host settings: print each setting with its origin."""

from dataclasses import dataclass
from pathlib import Path

from common.program.request import Request, option, part
from common.program.settings import listing
from phone_host.declared_settings import PhoneHostSettings
from phone_host.settings import check, resolve_settings

EXAMPLES = """  phone-host settings
  phone-host settings --config host.toml --tolerance 5
  PHONE_HOST_FIFO=2:block phone-host settings --json
"""


@dataclass(frozen=True, slots=True, kw_only=True)
class SettingsRequest(Request):
    """What settings can be told: each setting, by the option that it has for `run`."""

    config: Path | None = option("--config", type=Path, metavar="FILE", help="settings file (TOML)")
    settings: PhoneHostSettings = part(PhoneHostSettings)


def run(request: SettingsRequest) -> int:
    """Print the settings. Refuse those that `run` would refuse."""
    resolved = resolve_settings(request.given)
    check(resolved.values)
    print(listing(resolved, as_json=request.as_json))
    return 0
