"""One mean and its SD, as printed: the line that `recoil grim` prints. The mean is judged before the SD."""

from __future__ import annotations

import re
from dataclasses import dataclass
from functools import partial

from analysis.paper.audit.claims import AuditFinding
from analysis.paper.audit.means import debit, grim, grimmer
from analysis.paper.audit.page import FindingEntry, finding_entry
from analysis.paper.audit.printed import CheckResult, Interval, Rounding, read_printed
from experiments.config.door import ConfigError

_NUMBER = r"[-−]?\d*[.,]?\d+"
_SCALE = re.compile(rf"\s*({_NUMBER})\s*(?:-|–|to|\.\.)\s*({_NUMBER})\s*")


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanAndSd:
    """What was found of a mean, and of its SD if one is given and the mean can be; `not_judged` says why not.

    `off_scale` says that the mean lies beyond the scale, where no other reason matters.
    """

    mean: FindingEntry
    sd: FindingEntry | None
    not_judged: str | None
    off_scale: str | None = None

    @property
    def exceptions(self) -> bool:
        """Is one of them not attainable?"""
        return any(one is not None and one.result.verdict == "not attainable" for one in (self.mean, self.sd))

    def as_text(self) -> str:
        """The verdict on each, and why."""
        mean = _told(self.mean) if self.off_scale is None else f"mean: {self.mean.result.verdict}. {self.off_scale}"
        sd = [] if self.sd is None else [_told(self.sd)]
        return "\n".join([mean, *sd, *([self.not_judged] if self.not_judged else [])])


def _told(one: FindingEntry) -> str:
    said = one.sentences[:1] if one.result.verdict == "attainable" else one.sentences
    return f"{one.place}: {one.result.verdict}. {' '.join(said)}"


def mean_and_sd(
    mean: str, n: int, sd: str | None = None, scale: str | None = None, *, grain: str = "1", items: int = 1
) -> MeanAndSd:
    """Can n scores have this mean (GRIM), and with it this SD (GRIMMER, of scores 0 or 1 DEBIT)?

    `scale`: its ends, as "1-5"; scores come in steps of `grain`, or are means of so many `items`. `ConfigError` with
    the option for what is no number or no scale.

    >>> mean_and_sd("3.47", 23, "1.12", "1-5").mean.result.judged.readings
    ('truncation',)
    """
    for option, text in (("mean", mean), ("sd", sd), ("grain", grain)):
        _check(option, text)
    if sd is not None and read_printed(sd).value < 0:
        raise ConfigError(f"--sd: {sd} is below 0 (rule: a standard deviation is 0 or more)")
    if sd is not None and n == 1:
        raise ConfigError("--sd: one score has no standard deviation; leave it out")
    low, high = _ends(scale)
    try:
        first = grim(mean, n, grain=grain, items=items, low=low, high=high)
        if sd is None or first.verdict == "not attainable":
            unsaid = None if sd is None else f"SD = {sd} is not judged, since no data have that mean."
            return MeanAndSd(
                mean=_entry("mean", first), sd=None, not_judged=unsaid, off_scale=_off_scale(mean, low, high)
            )
        zero_or_one = (low, high, grain, items) == ("0", "1", "1", 1)
        scores = partial(grimmer, grain=grain, items=items, low=low, high=high)
        second = (debit if zero_or_one else scores)(mean, sd, n)
    except ValueError as error:
        raise ConfigError(str(error)) from error
    return MeanAndSd(mean=_entry("mean", first), sd=_entry("SD", second), not_judged=None)


def _check(option: str, text: str | None) -> None:
    try:
        number = read_printed("0" if text is None else text)
    except ValueError as error:
        raise ConfigError(f"--{option}: {error}") from error
    if number.relation != "=":
        raise ConfigError(f"--{option}: {text} is a bound; give a number")


def _ends(scale: str | None) -> tuple[str | None, str | None]:
    if scale is None:
        return None, None
    found = _SCALE.fullmatch(scale)
    if found is None:
        raise ConfigError(f"--scale: {scale[:40]!r} is no scale (rule: its two ends, as 1-5 or 0-100)")
    for end in found.groups():
        _check("scale", end)
    low, high = (read_printed(end).value for end in found.groups())
    if low >= high:
        said = "has the same end twice" if low == high else "begins with its upper end"
        raise ConfigError(f"--scale: {scale} {said} (rule: two ends that differ, the lower one first, as 1-5)")
    return found[1], found[2]


def _off_scale(mean: str, low: str | None, high: str | None) -> str | None:
    """What is said of a mean that lies beyond the scale however it was rounded."""
    if low is None or high is None:
        return None
    within = Interval(read_printed(low).value, read_printed(high).value)
    if within.meets(read_printed(mean).interval(Rounding.ANY)):
        return None
    return (
        f"{mean} lies beyond the scale of {low} to {high}: no scores on it have such a mean, however many they are. "
        "Either the mean or the scale is not the one of the scores."
    )


def _entry(place: str, result: CheckResult) -> FindingEntry:
    return finding_entry(AuditFinding(place=place, quote=result.printed, note="", result=result))
