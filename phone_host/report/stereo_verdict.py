"""Answers for a result of `stereo`: is my depth right, and how far can I trust it? Pure."""

from phone_host.report.cut_words import distance_text
from phone_host.report.report_page import Headline
from phone_host.report.stereo_report import PairReport, SetReport


def pair_verdict(pair: PairReport) -> tuple[Headline, str]:
    """Judge one pair.

    Args:
        pair: its report.

    Returns:
        The verdict, and one sentence.
    """
    blocking = next((remark for remark in pair.remarks if remark.is_blocking), None)
    if blocking is not None:
        return Headline.BAD, _sentence(blocking.text)
    doubt = next((remark for remark in pair.remarks if remark.is_doubt), None)
    if not pair.has_depth:
        remedy = doubt.remedy if doubt is not None else "check that both images show the same scene, left and right"
        return Headline.BAD, _sentence(f"No pixel has depth: {remedy}")
    if doubt is not None:
        return Headline.WARNING, _sentence(doubt.text)
    share = f"{pair.density:.0%} of the pixels"
    limits, geometry = pair.limits, pair.geometry
    if limits is None or geometry is None:
        return (
            Headline.WARNING,
            f"{share} have a disparity, but no metres follow: focal length and baseline are unknown.",
        )
    # From z = f b / d: an error of e px makes z wrong by e z / (f b).
    wrong = limits.disparity_error_px * limits.far_m / (geometry.focal_px * geometry.baseline_m)
    return Headline.GOOD, (
        f"Nothing speaks against this depth: {share} have one, and up to {distance_text(limits.far_m)} it is wrong by no more"
        f" than {wrong:.0%} where the match is right."
    )


def set_verdict(report: SetReport) -> tuple[Headline, str]:
    """Judge several pairs together.

    Args:
        report: all of them.

    Returns:
        The verdict, and one sentence.
    """
    verdicts = [pair_verdict(pair)[0] for pair in report.computed]
    count, good = len(report.pairs), verdicts.count(Headline.GOOD)
    bad = verdicts.count(Headline.BAD) + len(report.failed)
    if good == count:
        return Headline.GOOD, f"Nothing speaks against the depth of any of the {count} pairs."
    words = [f"{good} of {count} pairs {'looks' if good == 1 else 'look'} right"]
    if bad:
        words.append(f"{bad} gave no depth or cannot be right")
    if doubtful := count - good - bad:
        words.append(f"{doubtful} {'is' if doubtful == 1 else 'are'} in doubt")
    return (Headline.BAD if bad == count else Headline.WARNING), _sentence(", ".join(words))


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:].removesuffix('.')}."
