"""Whether a user may open a device, and who has it open already. Pure."""

from dataclasses import dataclass

from common.diagnostic import Diagnostic
from common.doctor.finding import fail, ok

_READ_AND_WRITE = 0o6


@dataclass(frozen=True, slots=True)
class Account:
    """A user.

    Attributes:
        name: for people.
        uid: user id; 0 may do everything.
        groups: ids of all groups.
        is_me: whether this is the user who asks.
    """

    name: str
    uid: int
    groups: frozenset[int]
    is_me: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """A device node.

    Attributes:
        path: path of the node itself, not of a link to it.
        uid: owner.
        gid: group.
        group: the group's name.
        mode: permission bits.
        open_to_me: whether the user who asks may open it, taking access lists (such as logind's) into account.
    """

    path: str
    uid: int
    gid: int
    group: str
    mode: int
    open_to_me: bool


@dataclass(frozen=True, slots=True)
class Holder:
    """A process that has something open.

    Attributes:
        pid: its id.
        name: its command.
    """

    pid: int
    name: str

    def __str__(self) -> str:
        return f"{self.name} (pid {self.pid})"


def may_open(node: Node, account: Account) -> bool:
    """Whether a user may read and write a node, as far as owner, group and mode show."""
    if account.uid == 0:
        return True
    if account.is_me:
        return node.open_to_me
    if node.uid == account.uid:
        bits = node.mode >> 6
    elif node.gid in account.groups:
        bits = node.mode >> 3
    else:
        bits = node.mode
    return bits & _READ_AND_WRITE == _READ_AND_WRITE


def check_access(what: str, node: Node, account: Account) -> Diagnostic:
    """Judge whether a user may open a device."""
    state = f"{node.path} (group {node.group}, mode {node.mode:03o})"
    if may_open(node, account):
        return ok(what, f"user {account.name} may open {state}")
    if node.mode >> 3 & _READ_AND_WRITE != _READ_AND_WRITE or node.gid == 0:
        return fail(
            what,
            f"user {account.name} may not open {state}",
            f"a udev rule or a program has changed it: plug it in again, or chmod 660 {node.path}",
        )
    again = "log in again" if account.is_me else "restart the service"
    return fail(
        what, f"user {account.name} may not open {state}", f"sudo usermod -aG {node.group} {account.name}, then {again}"
    )
