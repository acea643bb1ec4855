"""Names of groups. Python for Android may lack the module `grp` (docs.python.org: "not Android"); groups then have no names."""


def group_name(gid: int) -> str:
    """Return a group's name; empty if it has none."""
    return _entry(gid)[0]


def group_of_one(gid: int) -> str:
    """Return the name of a group that has no member, or only one of its own name; empty otherwise."""
    name, members = _entry(gid)
    return name if members <= {name} else ""


def _entry(gid: int) -> tuple[str, set[str]]:
    try:
        import grp  # noqa: PLC0415 - optional

        group = grp.getgrgid(gid)
    except (ImportError, KeyError):
        return "", set()
    return group.gr_name, set(group.gr_mem)
