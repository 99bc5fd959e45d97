"""Commands before there are data: simulated power, the design search, and models fitted to rates and times."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from typer.core import TyperGroup

from analysis.report.terminal import (
    AsJsonOption,
    ColumnsOption,
    FixedSeedOption,
    GunConfigOption,
    IncludeSyntheticOption,
    WorkersOption,
    end,
    in_text,
    progress,
    say,
    say_how_long,
    show,
    tracked,
)
from device.messages import few_of_each

if TYPE_CHECKING:
    from analysis.predict.power.grid import PowerRequest

ParticipantsOption = Annotated[str | None, typer.Option(metavar="N,N-N", help="How many people, such as 8,10,14-20.")]
TrialsListOption = Annotated[
    str | None, typer.Option(metavar="N,N-N", help="Trials of a method; the config's own unless given.")
]
MethodsOption = Annotated[
    list[str] | None, typer.Option(metavar="NAME,NAME", help="Compare these alone; may come again.")
]
EffectOption = Annotated[
    str | None, typer.Option(metavar="FACTOR,FACTOR", help="Factors on what people feel; 1 is the config.")
]
SimulatedOption = Annotated[
    int | None,
    typer.Option(
        min=1, max=10_000_000, help="Simulated studies of each design (10,000), or people for a threshold (200)."
    ),
]
NullOption = Annotated[bool, typer.Option("--null", help="People who feel no difference: false positives.")]
SchedulerOption = Annotated[str | None, typer.Option(metavar="ADDRESS", help="Work on this Dask cluster instead.")]
ConfigUnlessMergedArgument = Annotated[
    str | None, typer.Argument(help="File or name of a shipped config; with --merge that of the shards unless given.")
]
ShardOption = Annotated[
    str | None, typer.Option(metavar="K/N", help="Do the K-th of N parts alone, as a file in --out for --merge.")
]
MergeOption = Annotated[
    Path | None, typer.Option(metavar="DIR", help="Put the shards in this folder together instead of simulating.")
]


def power(
    ctx: typer.Context,
    config: ConfigUnlessMergedArgument = None,
    *,
    participants: ParticipantsOption = None,
    trials: TrialsListOption = None,
    methods: MethodsOption = None,
    effect: EffectOption = None,
    studies: SimulatedOption = None,
    target: Annotated[float, typer.Option(help="Power that a design is to reach.")] = 0.8,
    null: NullOption = False,
    seed: FixedSeedOption = 1,
    paper: Annotated[str, typer.Option(help="Published numbers whose pattern may recur.")] = "paper",
    workers: WorkersOption = None,
    scheduler: SchedulerOption = None,
    shard: ShardOption = None,
    merge: MergeOption = None,
    out: Annotated[Path, typer.Option(help="Folder for power.json, figures and report.")] = Path("results/power"),
    as_json: AsJsonOption = False,
) -> None:
    """Simulated power and precision: how many people and trials does it take, and what does it cost?

    Of a design with a threshold: by procedure and trials, how well it would be known.
    """
    from analysis.predict.power.grid import PowerRequest
    from analysis.predict.threshold_plan.run import procedures_of
    from experiments.config.door import ConfigError

    if shard is not None and merge is not None:
        raise ConfigError(f"--shard {shard} --merge {merge}: first each job with --shard, then, once, --merge alone")
    if config is None and merge is None:
        raise ConfigError("CONFIG is missing: name a file or a shipped config, as in `recoil power direction`")
    if config is not None and procedures_of(config):
        _check_only(ctx, f"{config} has a threshold", ("config", "trials", "studies", "seed", "out", "as_json"))
        return _of_threshold(config, trials, studies, seed, out, as_json)
    request = PowerRequest(
        config=config or "",
        participants=participants,
        trials=trials,
        methods=tuple(methods or ()),
        effects=effect,
        studies=studies or 10_000,
        target=target,
        null=null,
        seed=seed,
        paper=paper,
    )
    if shard is not None:
        return _of_shard(request, shard, workers, scheduler, out, as_json)
    return _of_studies(request, merge, workers, scheduler, out, as_json)


def _of_shard(
    request: PowerRequest, shard: str, workers: int | None, scheduler: str | None, out: Path, as_json: bool
) -> None:
    from analysis.predict.power import run as feature

    number = feature.shard_number(shard)
    if not (out / number.file_name).exists():
        say_how_long(feature.power_time_s(request, workers, scheduler, number))
    part, was_there = feature.power_shard(request, number, out, progress, workers=workers, scheduler=scheduler)
    show(part, feature.shard_in_short(part, out, was_there=was_there), as_json)


def _of_studies(
    request: PowerRequest, merge: Path | None, workers: int | None, scheduler: str | None, out: Path, as_json: bool
) -> None:
    from analysis.predict.power import run as feature

    if merge is None:
        say_how_long(feature.power_time_s(request, workers, scheduler))
        found = feature.power(request, out, progress, workers, scheduler)
    else:
        found = feature.merged_power(merge, request, out)
    show(found, f"{in_text(feature.in_short(found))}\nReport: {out / 'report.html'}", as_json)


def _check_only(ctx: typer.Context, why: str, known: tuple[str, ...]) -> None:
    """`ConfigError` naming the options that were given and say nothing there."""
    from experiments.config.door import ConfigError

    given = [
        one
        for one in ctx.command.params
        if (source := ctx.get_parameter_source(one.name or "")) and source.name == "COMMANDLINE"
    ]
    unused = [one.opts[0] for one in given if one.name not in known]
    if unused:
        raise ConfigError(f"{', '.join(unused)}: {why}, of which only --trials and --studies are asked")


def _of_threshold(config: str, trials: str | None, people: int | None, seed: int, out: Path, as_json: bool) -> None:
    from analysis.predict.threshold_plan import page
    from analysis.predict.threshold_plan.run import PEOPLE, TRACK_TRIALS, ThresholdRequest, plan_time_s

    request = ThresholdRequest(config=config, trials=trials or TRACK_TRIALS, people=people or PEOPLE, seed=seed)
    say_how_long(plan_time_s(request))
    found = page.threshold_plan(request, out, progress)
    show(found, f"{in_text(page.plan_in_short(found))}\nReport: {out / 'report.html'}", as_json)


ConfigOrGunArgument = Annotated[str | None, typer.Argument(help="Config whose gun is meant; else the shipped gun.")]
GunOption = Annotated[str | None, typer.Option(help="Config of a gun, instead of CONFIG.")]
_RANGE = "FROM-TO"
FrictionOption = Annotated[
    str | None, typer.Option(metavar=_RANGE, help="Damper friction in N; from the gun's own on.")
]
VoltageOption = Annotated[str | None, typer.Option(metavar=_RANGE, help="Voltage in V; 0-24 unless given.")]
PulseOption = Annotated[
    str | None, typer.Option(metavar=_RANGE, help="Pulse in s, or one value; 0.002-0.02 unless given.")
]
RateAboveOption = Annotated[
    float, typer.Option(metavar="HZ", help="Shots a second that a proposed design must keep up.")
]
GridOption = Annotated[int, typer.Option(help="Values of friction and of voltage; of the pulse a fifth as many.")]


def design(
    config: ConfigOrGunArgument = None,
    *,
    gun: GunOption = None,
    friction: FrictionOption = None,
    voltage: VoltageOption = None,
    pulse: PulseOption = None,
    rate_above: RateAboveOption = 5.0,
    grid: GridOption = 40,
    seed: FixedSeedOption = 1,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Processes, if shots are interpreted (no extra `fast`); all cores unless given."),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for design.json, figures and report.")] = Path("results/design"),
    as_json: AsJsonOption = False,
) -> None:
    """Which damper, voltage and pulse would be felt best, and where a direction begins to be felt. Predictions."""
    from analysis.predict.design_search import run as feature

    request = feature.DesignRequest(
        config=config,
        gun=gun,
        friction=friction,
        voltage=voltage,
        pulse=pulse,
        rate_above_Hz=rate_above,
        grid=grid,
        seed=seed,
    )
    say_how_long(feature.search_time_s(request, workers))
    say(feature.waiting_note())
    found = feature.design(request, workers, out, progress)
    show(found, f"{in_text(feature.in_short(found))}\nReport: {out / 'report.html'}", as_json)
    raise end(exceptions=found.best is None)


class _PerceptUnlessNamed(TyperGroup):
    """`recoil fit` with options alone, or with nothing, fits the percept."""

    def parse_args(self, ctx: typer.Context, args: list[str]) -> list[str]:  # type: ignore[override] # its own context
        named = args and (not args[0].startswith("-") or args[0] in ctx.help_option_names)
        return super().parse_args(ctx, args if named else ["percept", *args])


app = typer.Typer(
    cls=_PerceptUnlessNamed,
    help=(
        "Fit a model: `percept` (what of a shot says its direction, to a paper's rates; also what `recoil fit` alone "
        "does), `times` (how fast and how carefully people decide, to logs with their own response times) or "
        "`thresholds` (psychometric functions, to another program's answers)."
    ),
    rich_markup_mode=None,
)

PaperOption = Annotated[str, typer.Option(help="Published numbers: file, or the name of a shipped one.")]
RatesOption = Annotated[
    str | None, typer.Option(metavar="NAME=SHARE,...", help="Forward rates by method instead of a paper's.")
]
TrialsOption = Annotated[
    int | None, typer.Option(min=1, max=10**9, help="Forward trials behind each of --rates (140).")
]
SpreadOption = Annotated[
    float, typer.Option(metavar="FACTOR", help="People differ by so many times the assumed spread; 0: all alike.")
]
StudiesOption = Annotated[
    int | None,
    typer.Option(min=0, max=10_000_000, help="Simulated studies to judge a paper's fit by (10000); 0: none."),
]


@app.command()
def percept(
    *,
    paper: PaperOption = "paper",
    rates: RatesOption = None,
    trials: TrialsOption = None,
    gun: GunConfigOption = "gun",
    spread: SpreadOption = 0.0,
    studies: StudiesOption = None,
    seed: FixedSeedOption = 1,
    out: Annotated[Path, typer.Option(help="Folder for fit.json, percept.toml, figures and report.")] = Path(
        "results/fit"
    ),
    as_json: AsJsonOption = False,
) -> None:
    """The percept fitted to forward rates, what they cannot tell, and studies of it against what else is published."""
    from analysis.predict.fit import percept as feature

    request = feature.PerceptRequest(
        paper=paper, rates=rates, trials=trials, gun=gun, spread=spread, studies=studies, seed=seed
    )
    found = feature.percept(request, out, progress)
    text = "\n".join(map(in_text, feature.in_short(found)))
    show(found, f"{text}\nReport: {out / 'report.html'}; for a config: {out / 'percept.toml'}", as_json)


@app.command("thresholds")
def fit_thresholds(
    answers: Annotated[list[Path], typer.Argument(metavar="PATH...", help="Files of another program, or folders.")],
    columns: Annotated[
        Path | None,
        typer.Option(metavar="MAP.toml", help="Which columns hold level and success; required.", show_default=False),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder for fit.json, figure and report.")] = Path("results/fit-thresholds"),
    as_json: AsJsonOption = False,
) -> None:
    """Psychometric functions of another program's answers at levels of a stimulus."""
    from analysis.summary import mapped_thresholds as feature
    from experiments.config.door import ConfigError

    if columns is None:
        raise ConfigError(
            "fit thresholds: give --columns MAP.toml, which says what columns hold; `recoil configs --copy DIR` has "
            "examples/levels.toml. Recoil's own logs are fitted by `recoil analyze`"
        )
    found = feature.mapped_thresholds(answers, columns, out)
    for line in few_of_each([f"left out: {one}" for one in found.problems]):
        say(f"recoil: {line}")
    short = in_text(feature.thresholds_in_short(found))
    show(found, f"{short}\nReport: {out / 'report.html'}", as_json)
    raise end(exceptions=bool(found.problems))


@app.command()
def times(
    logs: Annotated[list[Path], typer.Argument(metavar="LOGS...", help="Logs of experiment 1, or folders with logs.")],
    *,
    lapses: Annotated[
        str, typer.Option(metavar="none|data|A-B", help="Lapses: none, over the times' range, or from A to B s.")
    ] = "none",
    bias: Annotated[bool, typer.Option("--bias/--no-bias", help="Fit the start, or hold it at one half.")] = True,
    profile: Annotated[bool, typer.Option("--profile", help="Likelihood intervals as well; slower.")] = False,
    columns: ColumnsOption = None,
    include_synthetic: IncludeSyntheticOption = False,
    out: Annotated[Path, typer.Option(help="Folder for fit.json, figure and report.")] = Path("results/fit-times"),
    as_json: AsJsonOption = False,
) -> None:
    """The diffusion model (drift, boundary, start, non-decision time) fitted to people's own response times."""
    from analysis.predict.fit import times as feature

    request = feature.TimesRequest(
        paths=logs,
        columns=columns,
        include_synthetic=include_synthetic,
        lapses=lapses,
        bias=bias,
        profiled=profile,
    )
    done = feature.times(request, out, tracked, progress)
    missing = [*map(str, done.problems), *feature.left_out(done.fit)]
    for line in few_of_each([*(f"left out: {one}" for one in missing), *map(str, done.remarks)]):
        say(f"recoil: {line}")
    short = in_text(feature.in_short(done.fit, done.labels))
    show(done.fit, f"{short}\nReport: {out / 'report.html'}", as_json)
    raise end(exceptions=bool(missing or done.remarks))
