"""Answers for a result of `stereo`: is my depth right, and how far can I trust it? Pure."""

from dataclasses import replace

from common.words import counted
from phone_host.report.report_page import Headline
from phone_host.report.stereo_report import PairReport, SetReport


def pair_verdict(pair: PairReport) -> tuple[Headline, str]:
    """Return the verdict of one pair, and one sentence."""
    answer = pair.trust.answer
    return Headline(answer.grade.value), answer.sentence


def set_verdict(report: SetReport) -> tuple[Headline, str]:
    """Judge several pairs together."""
    if report.interrupted_of:
        verdict, sentence = set_verdict(replace(report, interrupted_of=0))
        stopped = f"Interrupted after {len(report.pairs)} of {counted(report.interrupted_of, 'pair')}. Of these: "
        return (
            Headline.WARNING if verdict is Headline.GOOD else verdict
        ), f"{stopped}{sentence[:1].lower()}{sentence[1:]}"
    verdicts = [pair_verdict(pair)[0] for pair in report.computed]
    count, good = len(report.pairs), verdicts.count(Headline.GOOD)
    bad = verdicts.count(Headline.BAD) + len(report.failed)
    if good == count:
        return (
            Headline.GOOD,
            f"Nothing speaks against the depth of {'the pair' if count == 1 else f'any of the {count} pairs'}.",
        )
    words = [f"{good} of {counted(count, 'pair')} {'looks' if good == 1 else 'look'} right"]
    if bad:
        words.append(f"{bad} gave no depth or cannot be right")
    if doubtful := count - good - bad:
        words.append(f"{doubtful} {'is' if doubtful == 1 else 'are'} in doubt")
    return (Headline.BAD if bad == count else Headline.WARNING), f"{', '.join(words)}."
