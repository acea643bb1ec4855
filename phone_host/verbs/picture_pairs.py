"""Pairs of image files as the options of a verb name them: how they are matched, and the check of their results folder before the work."""

import argparse
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from common.errors import SettingsError
from common.places import resolved
from common.program.terminal import say
from phone_host.jobs.output_folders import announce_other_report, require_alone, require_writable, spare_inputs, writing
from phone_host.report.stereo_report import Size
from phone_host.run.file_pairs import FilePairs, Matching
from phone_host.run.progress_bar import StepBar, step_bar
from phone_host.settings import most_pixels
from phone_host.stereo.core import StereoCore
from phone_host.stereo.default_matcher import default_matcher, default_note
from phone_host.stereo.view_files import pair_files
from phone_host.verbs.given_pictures import given_pictures
from phone_host.verbs.stereo_options import metric_core, orientations

MakeCore = Callable[[argparse.Namespace, str, Size, Path], StereoCore]
"""Makes the core by the options, the matcher's name, the size of the left images, px, and one of them."""


def matching_of(options: argparse.Namespace, image: Path) -> Matching:
    """Return how the pair is matched that a verb measures; its core gives metres.

    Args:
        options: of the verb.
        image: the left one.
    """
    matcher = options.matcher or default_matcher().value
    return Matching(
        make_core=lambda size_px: metric_core(options, matcher, size_px, image),
        most_pixels=most_pixels(None, options.max_megapixels),
        mounted=orientations(options),
    )


def file_pairs(options: argparse.Namespace, make_core: MakeCore = metric_core) -> FilePairs:
    """Pair the files that a verb names.

    Args:
        options: of the verb.
        make_core: makes the core.

    Raises:
        SettingsError: there is one side only.
        UnavailableError: the folders for a recording's pictures cannot be had.
        DataError: there are no pairs.
    """
    matcher, limit = options.matcher or default_matcher().value, most_pixels(None, options.max_megapixels)
    given = given_pictures(options.images, options.out, limit)
    files = pair_files(given.left, given.right)
    return FilePairs(
        files=files,
        out=options.out,
        make_core=lambda size_px: make_core(options, matcher, size_px, files.pairs[0][1]),
        matcher=matcher,
        matcher_note="" if options.matcher else default_note(),
        most_pixels=limit,
        mounted=orientations(options),
        tell=lambda line: say(f"phone-host: {line}", sys.stderr, flush=True),
    )


def require_place(pairs: FilePairs, names: str, command: str) -> None:
    """Refuse a results folder that cannot be written to, holds the photographs or would lose them; keep other programs out of it.

    Args:
        pairs: the photographs, and the folder.
        names: pattern of the names in it that are replaced.
        command: the verb.

    Raises:
        SettingsError: the photographs lie in it.
        UnavailableError: it cannot be written to, or another program writes there.
    """
    out, files = pairs.out, pairs.files
    require_writable(out)
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


@contextmanager
def reading(pairs: FilePairs) -> Iterator[StepBar]:
    """Show a bar for the pairs while a block computes and writes them.

    Raises:
        UnavailableError: the results cannot be written.
    """
    count = len(pairs.files.pairs)
    with writing(pairs.out), step_bar("reading", count if count > 1 else None) as watcher:
        yield watcher
