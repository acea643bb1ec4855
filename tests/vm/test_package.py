"""The package's life on a board: installed, serving, removed, purged, and installed again."""

import json
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.support.programs import until
from tests.vm.conftest import ROOT, booted
from tests.vm.guest import UNIT, Guest
from tests.vm.machine import Architecture

pytestmark = pytest.mark.timeout(600)  # the first test boots the board

# What a package may touch. /run and /proc live in memory; dpkg and systemd keep their own records; ldconfig's cache is rewritten anyhow.
_EVERYTHING = (
    (
        "find / -xdev ( -path /run -o -path /proc -o -path /sys -o -path /tmp -o -path /root -o -path /var/log -o -path /var/lib/dpkg "
        "-o -path /var/lib/systemd -o -path /var/cache -o -path /var/tmp ) -prune -o -printf '%p %y %u %m\\n' | sort"
    )
    .replace("( ", r"\( ")
    .replace(" )", r" \)")
)


@pytest.fixture(scope="module")
def bare_guest() -> Iterator[Guest]:
    """A board on which the package never was: the snapshot of the others has it."""
    with booted(Architecture.AMD64) as guest:
        yield guest


@pytest.fixture(scope="module")
def before(bare_guest: Guest) -> str:
    """Every file and user of the board, without the package."""
    return bare_guest.sh(_EVERYTHING + "; cat /etc/passwd /etc/group")


@pytest.fixture(scope="module")
def installed(bare_guest: Guest, before: str, package: Path) -> Guest:
    """The board with the package in its default state."""
    assert before
    bare_guest.put(package, "/var/tmp")
    bare_guest.sh(f"dpkg -i /var/tmp/{package.name}")
    return bare_guest


def test_the_service_runs_after_installation_and_names_what_is_missing(installed: Guest) -> None:
    """Without configuration the service is enabled and up, and its status names the camera that is not there yet."""
    assert installed.show("UnitFileState") == "enabled"
    installed.until("ActiveState", "active", "the service is up")
    installed.until("StatusText", "waiting for the camera", "the service says what is missing")


def test_the_service_is_its_own_user_in_two_groups(installed: Guest) -> None:
    """The agent runs as the user tandemscan in the groups video and dialout, without any capability."""
    process = installed.show("MainPID")
    status = installed.sh(f"cat /proc/{process}/status")
    groups = installed.sh("id -Gn tandemscan").split()
    assert installed.sh(f"stat -c %U /proc/{process}").strip() == "tandemscan"
    assert set(groups) == {"tandemscan", "video", "dialout"}
    for name in ("CapEff", "CapPrm", "CapBnd", "CapAmb"):
        assert f"{name}:\t0000000000000000" in status
    assert "NoNewPrivs:\t1" in status


def test_the_exposure_is_at_most_2(installed: Guest) -> None:
    """systemd-analyze security gives the running unit an exposure of 2.0 at most."""
    installed.sh(f"systemd-analyze security {UNIT} --threshold=20 --no-pager")


def test_the_unit_is_understood_without_a_warning(installed: Guest) -> None:
    """systemd-analyze verify has nothing to say about the unit."""
    assert installed.sh(f"systemd-analyze verify --man=no {UNIT}.service 2>&1") == ""


def test_the_launcher_ignores_a_foreign_common(installed: Guest) -> None:
    """board-agent started in a folder with a foreign `common` prints its own settings; the conffile is understood."""
    installed.sh("mkdir -p /tmp/x/common && echo 'raise SystemExit(9)' > /tmp/x/common/__init__.py")
    shown = installed.sh("cd /tmp/x && board-agent settings --json --config /etc/tandemscan/board-agent.toml")
    origins = {name: setting["origin"] for name, setting in json.loads(shown).items()}
    assert set(origins.values()) == {"/etc/tandemscan/board-agent.toml"}, "the conffile shows every setting"
    installed.sh("rm -r /tmp/x")


def test_keys_are_those_of_the_service(installed: Guest) -> None:
    """Without options `keys` shows the folder named in the service's settings."""
    settings = "/etc/tandemscan/board-agent.toml"
    installed.sh(f"cp -p {settings} /var/tmp/good && sed -i 's,^keys = .*,keys = \"/run/other\",' {settings}")
    try:
        shown = json.loads(installed.sh("board-agent keys --json"))
    finally:
        installed.sh(f"mv /var/tmp/good {settings}; rm -rf /run/other")
    assert shown["folder"] == "/run/other"


def test_byte_code_is_compiled_on_installation(installed: Guest) -> None:
    """Each module has its byte code, because the service itself may not write any."""
    assert installed.sh("find /usr/lib/tandemscan -name '*.py' | wc -l") == installed.sh(
        "find /usr/lib/tandemscan -name '*.pyc' | wc -l"
    )


def test_a_changed_conffile_outlives_an_upgrade_and_the_service_is_restarted(installed: Guest, package: Path) -> None:
    """A reinstallation keeps the owner's settings and starts the new code."""
    installed.sh("echo '# mine' >> /etc/tandemscan/board-agent.toml")
    process = installed.show("MainPID")
    installed.sh(f"dpkg -i /var/tmp/{package.name}")
    assert "# mine" in installed.sh("cat /etc/tandemscan/board-agent.toml")
    until(lambda: installed.show("MainPID") not in {process, "0"}, "the service runs the new code")


def test_a_settings_mistake_is_one_line_in_the_journal_and_heals_by_itself(installed: Guest) -> None:
    """With an invalid value the service says which one and keeps trying; once it is corrected the service comes up unasked."""
    installed.sh("cp -p /etc/tandemscan/board-agent.toml /var/tmp/good")
    installed.write("/etc/tandemscan/board-agent.toml", 'camera = 7\nlink = ["tcp://*:5555"]\n')
    installed.code(f"systemctl restart {UNIT}")
    until(lambda: "camera in /etc/tandemscan/board-agent.toml is 7" in installed.journal(), "the mistake is named")
    until(lambda: int(installed.show("NRestarts")) >= 6, "it never gives up: systemd's own default would after five")
    installed.sh("cp -p /var/tmp/good /etc/tandemscan/board-agent.toml && rm /var/tmp/good")
    installed.until("ActiveState", "active", "the service is back")
    assert "Traceback" not in installed.journal()


def test_removal_keeps_the_settings_and_purge_leaves_nothing(installed: Guest, before: str, package: Path) -> None:
    """After removal only the conffile is left; after purge every file, user and group is as before the installation."""
    installed.sh("dpkg --remove tandemscan-board")
    assert installed.show("ActiveState") == "inactive"
    assert "# mine" in installed.sh("cat /etc/tandemscan/board-agent.toml")
    assert installed.code("test -e /usr/lib/tandemscan") != 0
    installed.sh("dpkg --purge tandemscan-board")
    after = installed.sh(_EVERYTHING + "; cat /etc/passwd /etc/group")
    changed = set(before.splitlines()) ^ set(after.splitlines())
    # Backups that the user tools themselves write, in every Debian.
    assert {
        line
        for line in changed
        if not line.startswith(("/etc/passwd- ", "/etc/group- ", "/etc/shadow- ", "/etc/gshadow- "))
    } == set()
    assert installed.show("LoadState") == "not-found"
    installed.sh(f"dpkg -i /var/tmp/{package.name}")
    installed.until("ActiveState", "active", "it can be installed again")


def test_two_builds_are_equal_byte_for_byte(tmp_path: Path) -> None:
    """The package is reproducible, whatever the umask, the time and the folder."""
    built: list[bytes] = []
    for umask in ("022", "077"):
        tree = tmp_path / umask
        for part in ("board_agent", "common", "deploy/board"):
            shutil.copytree(ROOT / part if not built else tmp_path / "022" / part, tree / part)
        shutil.copy(ROOT / "pyproject.toml", tree)
        (tree / "docs").mkdir()
        shutil.copy(ROOT / "docs" / "board.md", tree / "docs")
        command = f"umask {umask}; SOURCE_DATE_EPOCH=1700000000 deploy/board/build-deb"
        subprocess.run(["sh", "-c", command], cwd=tree, check=True, capture_output=True)
        (package,) = (tree / "dist").iterdir()
        built.append(package.read_bytes())
    assert built[0] == built[1]
