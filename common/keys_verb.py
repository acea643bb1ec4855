"""What the `keys` verbs of both programs do: change a folder of keys, and list it."""

import json
from collections.abc import Sequence
from dataclasses import asdict

from common.keys import KeyFolder
from common.peers import Peer, clean_name
from common.plain_text import printable_lines


def change(
    folder: KeyFolder, *, forget: str | None, new: bool, add: Sequence[str] | None, address: str, when: str
) -> str:
    """Do what the options of a `keys` verb ask for.

    Args:
        folder: the folder.
        forget: name of a peer that is no longer to be trusted; None: nobody.
        new: whether to make a new key.
        add: name and public key of a peer to trust; None: nobody.
        address: link on which that peer listens; empty if it does not.
        when: local wall time.

    Returns:
        What the user should be told about it in one line; usually nothing.

    Raises:
        SettingsError: a name or key makes no sense.
        DataError: the files are bad.
        UnavailableError: they cannot be written.
    """
    if new:
        folder.renew()
    if forget is not None:
        folder.forget(forget)
    if add is not None:
        name = folder.add(Peer(name=add[0], key=add[1], added=when, address=address)).name
        if name != add[0]:
            why = (
                "another machine has that name"
                if clean_name(add[0]) == add[0]
                else "names are of letters, digits and ._-"
            )
            return f"{add[0]!r} is kept as {name}: {why}"
    return ""


def listing(folder: KeyFolder, *, as_json: bool) -> str:
    """What a `keys` verb prints: this machine's public key and its trusted peers, never the secret key.

    Args:
        folder: the folder; its key is created if there is none.
        as_json: whether as one JSON object; else as lines for people.

    Raises:
        DataError: the files are bad.
        UnavailableError: they cannot be read.
    """
    own, peers = folder.own(), folder.peers()
    if as_json:
        known = [asdict(peer) for peer in peers]
        return json.dumps({"folder": str(folder.path), "public": own.public, "peers": known})
    rows = [(peer.name, peer.key, peer.added, peer.address) for peer in peers]
    widths = [max((len(row[column]) for row in rows), default=0) for column in range(4)]
    lines = ["  ".join(f"{cell:{width}}" for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]
    return printable_lines(
        "\n".join((f"folder  {folder.path}", f"public  {own.public}", *(lines or ["nobody is known yet"])))
    )
