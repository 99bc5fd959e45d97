"""The claims that lie in the sections of Recoil's own paper: participants, experiment 1, experiment 2."""

from __future__ import annotations

from collections.abc import Iterator

from analysis.paper import published
from analysis.paper.audit.claims import (
    BinomialClaim,
    Claim,
    DfClaim,
    GrimClaim,
    PClaim,
    PercentClaim,
    RepeatedFClaim,
    TermModel,
    TotalClaim,
    TukeyClaim,
    TukeyPair,
    UnpublishedClaim,
)
from analysis.paper.audit.means import scale_of
from analysis.paper.audit.paper_file import PaperFile
from analysis.paper.audit.printed import Rounding, read_printed
from analysis.paper.paper import Participants, PublishedDirection, PublishedExperiment, PublishedPreference
from analysis.paper.published import named_in

RATE_GRAIN, RATING_GRAIN = "0.1", "0.1"
"""Of the correct rate, cor / 10; of the continuous rating scale, assumed: it has no printed grain."""
STARS = {"0.05": "0.01", "0.01": "0.001"}
"""What a star at one level says about the next (caption of Fig. 8)."""


def derived(paper: PaperFile) -> tuple[Claim, ...]:
    """The claims of the sections that the file has, in the order of the paper."""
    claims: list[Claim] = []
    if paper.participants is not None:
        claims += _participants(paper.participants)
    if paper.direction is not None:
        claims += _direction(paper.direction)
    if paper.preference is not None:
        claims += _preference(paper.preference)
    return tuple(claims)


def _participants(people: Participants) -> Iterator[Claim]:
    place = "III, Participants"
    sexes = [TermModel(times=[people.male]), TermModel(times=[people.female])]
    quote = f"{people.n} participants ({people.male} males and {people.female} females)"
    about = [named_in(name, published.PARTICIPANTS) for name in ("direction", "preference")]
    yield TotalClaim(place=place, quote=quote, about=about, kind="total", printed=str(people.n), terms=sexes)
    low = [TermModel(times=[people.age_min])]
    quote = f"ages ranged from {people.age_min} to {people.age_max} years"
    yield TotalClaim(place=place, quote=quote, kind="total", printed=str(people.age_max), terms=low, bound="at least")
    yield UnpublishedClaim(place=place, quote=quote, kind="unpublished", quantity="mean and SD of the ages")


def _direction(paper: PublishedDirection) -> Iterator[Claim]:
    place, protocol = "III.A, Results", paper.protocol
    yield from _protocol(paper)
    trials = str(protocol.forward_trials_per_session)
    for method, mean in paper.means.items():
        yield GrimClaim(
            place=place, quote=f"{method}: {mean}%", kind="grim", mean=f"{mean}%", n=paper.n, grain=RATE_GRAIN,
            low="0", high="1", note=f"rates in steps of 1/{trials}",
            about=[named_in("direction", published.mean_rate(method))],
        )  # fmt: skip
    means = [f"{paper.means[method]}%" for method in paper.methods]
    yield from _anova(paper, place, means)
    yield from _tukey(paper, place, means)
    n = paper.n * protocol.forward_trials_per_session
    for claim in paper.binomial:
        forward = claim.direction == "forward" and claim.method in paper.means
        counts = _counts(paper.means[claim.method], n) if forward else None
        yield BinomialClaim(
            place=place, quote=f"{claim.method}, {claim.direction}: p = {claim.p}", kind="binomial", p=claim.p, n=n,
            counts=counts, note="pooled over participants", about=[named_in("direction", published.one_half_p(claim))],
        )  # fmt: skip
    for method in paper.methods:
        yield UnpublishedClaim(place="Fig. 8(a)", quote=method, kind="unpublished", quantity=f"SD, {method}")
    yield UnpublishedClaim(
        place=place, quote="shooting backward", kind="unpublished", quantity="correct rates backward"
    )


def _counts(percent: str, n: int) -> list[int]:
    """The counts of n that print as a percentage."""
    return list(scale_of("1", "0", "1").sums(read_printed(f"{percent}%").interval(Rounding.ANY), n))


def _protocol(paper: PublishedDirection) -> Iterator[Claim]:
    place, protocol = "III.A, Method", paper.protocol
    trials = protocol.forward_trials_per_session + protocol.backward_trials_per_session
    terms = [TermModel(times=[protocol.sets_per_session, protocol.trials_per_set])]
    quote = f"{trials} trials ({protocol.sets_per_session} sets x {protocol.trials_per_set} repetitions)"
    yield TotalClaim(place=place, quote=quote, kind="total", printed=str(trials), terms=terms)
    one_each = [TermModel(times=[len(paper.methods)])]
    quote = f"{protocol.sessions} sessions corresponded to the rendering methods"
    yield TotalClaim(place=place, quote=quote, kind="total", printed=str(protocol.sessions), terms=one_each)
    breaks = [
        TermModel(times=[protocol.sessions, protocol.sets_per_session - 1, protocol.set_break_s], over=[60]),
        TermModel(times=[protocol.sessions - 1, protocol.session_break_s], over=[60]),
    ]
    quote = f"around {protocol.duration_min} minutes; {protocol.set_break_s} s and {protocol.session_break_s} s breaks"
    yield TotalClaim(
        place=place, quote=quote, kind="total", printed=protocol.duration_min, terms=breaks, bound="at least",
        note="the breaks alone, in minutes",
    )  # fmt: skip


def _anova(paper: PublishedExperiment, place: str, means: list[str] | None) -> Iterator[Claim]:
    anova, k = paper.anova, len(paper.methods)
    df = [str(value) for value in anova.df]
    quote = f"F({df[0]},{df[1]})={anova.F}, p<{anova.p_below}"
    name = _name(paper)
    about = [named_in(name, published.anova_df(part)) for part in ("effect", "error")]
    yield DfClaim(place=place, quote=quote, about=about, kind="df", df=df, design="repeated", counts=[paper.n, k])
    rates = means is not None
    yield RepeatedFClaim(
        place=place, quote=quote, kind="repeated-f", F=anova.F, n=paper.n, k=k, means=means,
        grain=RATE_GRAIN if rates else RATING_GRAIN, low="0", high="1" if rates else _scale_top(paper),
        transforms=["arcsine"] if rates else [], other_grains=["0.05"] if rates else [],
        note="0.05: both directions pooled, 20 trials" if rates else "grain of the continuous scale assumed",
        about=[named_in(name, published.ANOVA_F)],
    )  # fmt: skip
    p, about = f"< {anova.p_below}", [named_in(name, published.ANOVA_P)]
    yield PClaim(place=place, quote=quote, about=about, kind="p", statistic="F", value=anova.F, df=df, p=p)


def _name(paper: PublishedExperiment) -> str:
    return "preference" if isinstance(paper, PublishedPreference) else "direction"


def _scale_top(paper: PublishedExperiment) -> str:
    return str(paper.scale_max) if isinstance(paper, PublishedPreference) else "1"


def _tukey(paper: PublishedExperiment, place: str, means: list[str] | None) -> Iterator[Claim]:
    index = {method: i for i, method in enumerate(paper.methods)}
    pairs = [
        TukeyPair(
            higher=index[claim.higher], lower=index[claim.lower], p=f"< {claim.p_below}",
            p_at_least=STARS.get(claim.p_below),
        )
        for claim in paper.tukey
    ]  # fmt: skip
    quote = "; ".join(f"{claim.higher} above {claim.lower} (p<{claim.p_below})" for claim in paper.tukey)
    rates = means is not None
    yield TukeyClaim(
        place=place, quote=quote, kind="tukey", F=paper.anova.F, sizes=[paper.n] * len(paper.methods),
        comparisons=pairs, means=means, grain=RATE_GRAIN if rates else None, low="0" if rates else None,
        high="1" if rates else None, note="stars of Fig. 8: p < .05 also says not below .01",
        about=[named_in(_name(paper), published.tukey_p(claim)) for claim in paper.tukey],
    )  # fmt: skip


def _preference(paper: PublishedPreference) -> Iterator[Claim]:
    place, n = "III.B, Results", paper.n
    trials = [TermModel(times=[len(paper.methods)])]
    quote = f"{paper.protocol.trials} trials corresponded to the rendering methods"
    yield TotalClaim(place="III.B, Method", quote=quote, kind="total", printed=str(paper.protocol.trials), terms=trials)
    yield from _anova(paper, place, None)
    yield from _tukey(paper, place, None)
    lowest = f"{round(100 * paper.lowest.participants / n)}%"
    yield PercentClaim(
        place=place, quote=f"{lowest} of the participants gave lower scores for {paper.lowest.method}", kind="percent",
        percent=lowest, count=paper.lowest.participants, n=n,
        about=[named_in("preference", published.rated_lowest(paper.lowest))],
    )  # fmt: skip
    for method in paper.methods:
        yield UnpublishedClaim(place="Fig. 8(b)", quote=method, kind="unpublished", quantity=f"mean and SD, {method}")
