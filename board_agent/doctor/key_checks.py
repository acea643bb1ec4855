"""Checks the key folder of links that other machines reach: can its user read it, and does it hold any peer? Creates and changes nothing."""

import stat

from common.diagnostic import Diagnostic
from common.doctor.access import Account
from common.doctor.finding import fail, ok, warn
from common.errors import TandemError
from common.keys import KeyFolder


def check_keys(folder: KeyFolder, account: Account) -> Diagnostic:  # noqa: PLR0911 - one for each state of the folder
    """Judge a board's key folder.

    Args:
        folder: holds this machine's key and those of machines that may connect.
        account: the user who must read it.
    """
    path = folder.path
    try:
        if not path.exists():
            return warn("keys", f"{path} is not there yet, so nobody is known", "start the agent, then pair a host")
        # Key files are for their owner only, so whoever must read them must own them; root may read everything.
        states = {item.name: item.lstat() for item in path.iterdir()}
        owners = {name: state.st_uid for name, state in states.items() if stat.S_ISREG(state.st_mode)}
        if folder.has_key:
            folder.own()
        peers = folder.peers()
    except PermissionError:
        return warn("keys", f"{path} may not be read", "ask again as root: sudo")
    except OSError as error:
        return fail("keys", f"{path} cannot be used ({error.strerror})", "name another folder with --keys")
    except TandemError as error:
        return fail("keys", error.problem, error.remedy)
    foreign = sorted(name for name, uid in owners.items() if uid != account.uid)
    if foreign and account.uid != 0:
        problem = f"{', '.join(foreign)} in {path} may not be read by user {account.name}"
        return fail("keys", problem, f"sudo chown -R {account.name}: {path}")
    if not peers:
        return warn(
            "keys",
            f"{path} knows no host yet",
            "run phone-host pair on the host, and board-agent pair here: it shows the code",
        )
    return ok("keys", f"{path} knows {', '.join(peer.name for peer in peers)}")
