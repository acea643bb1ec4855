"""Checks the results folder of the verbs that read pairs of image files, before their work."""

from pathlib import Path

from common.errors import SettingsError
from common.places import resolved
from phone_host.run.stereo_results import require_writable
from phone_host.stereo.view_files import ViewFiles
from phone_host.verbs.output_folders import (
    announce_other_report,
    require_alone,
    require_folder,
    spare_inputs,
    unwritable,
)


def require_place(out: Path, files: ViewFiles, names: str, command: str) -> None:
    """Refuse a results folder that cannot be written to, holds the photographs or would lose them; keep other programs out of it.

    Args:
        out: the folder.
        files: the photographs.
        names: pattern of the names in it that are replaced.
        command: the verb.

    Raises:
        SettingsError: the photographs lie in it.
        UnavailableError: it cannot be written to, or another program writes there.
    """
    require_folder(out)
    try:
        require_writable(out)
    except OSError as error:
        raise unwritable(out, error) from error
    folders = {resolved(path).parent for _, left, right in files.pairs for path in (left, right)}
    if resolved(out) in folders:
        raise SettingsError(
            f"--out {out} is the folder of the images, where later runs would take pictures of depth for photographs",
            f"give a folder of its own, such as --out {out / 'scan'}",
        )
    for _, left, right in files.pairs:
        spare_inputs(out, names, {"LEFT": left, "RIGHT": right})
    require_alone(out)
    announce_other_report(out, command)
