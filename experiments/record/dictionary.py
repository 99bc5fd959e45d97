"""The data dictionary, printed from the columns: `python -m experiments.record.dictionary`."""

from __future__ import annotations

import sys
from collections.abc import Iterator

from experiments.record.tables import FILE_SUFFIX, TABLES, Column

_HEAD = """# Data dictionary

Made by `python -m experiments.record.dictionary > DATA_DICTIONARY.md`; do not edit by hand.

A run leaves two files in `RESULTS/sub-<ID>/`, readable by their owner only: the journal, which is the truth, and a
table made from it (`recoil rebuild` makes it again byte for byte). Words: a *session* is a block of trials with one
method, a *run* is one participant doing one experiment, a *study* is its participants.

## How tables are written

- RFC 4180: comma, CRLF, quotes doubled; UTF-8 without byte order mark; the header is the first line.
- An empty cell means that there is no value. 0 is a value: a rating of 0 is a rating.
- In columns of type *text* a leading `=`, `+`, `-`, `@`, tab, carriage return or `'` gets a `'` in front, so that no
  spreadsheet takes it for a formula; reading takes it off again. Numbers are never touched.
- Units end the names: `_s` seconds, `_N` newton, `_V` volt. *flag* is 1 or 0, *level* one of the listed values.
- One row a planned trial, in planned order, also those that were not reached.
"""

_TAIL = """
## Journal

`sub-<ID>_task-<experiment>_journal.jsonl`: one JSON object a line, appended and synced record by record. A line without
its end was never acknowledged and is not read. Times are seconds on a monotonic clock, and UTC; `clock` says whether
that clock was real or virtual (synthetic participants: breaks take no time).

| key | in | meaning |
| --- | --- | --- |
| `n` | every record | number of the record, from 0 |
| `kind` | every record | `run`, `step`, `outcome`, `shot`, `remark`, `stopped`, `resumed` or `finished` |
| `monotonic_s`, `utc` | every record | when it was written |
| `link` | every record | first 16 digits of the SHA-256 of the line before: a record changed by hand breaks the chain |
| `synced_s` | every record | when the record before it was on the disk |
| `plan`, `plan_sha256` | `run` | the whole frozen plan with its seed, and the hash of its canonical JSON |
| `setup`, `setup_sha256` | `run` | the resolved configs (and the synthetic table, if used) and their hash |
| `provenance`, `gun`, `clock` | `run`, `resumed` | versions, commit, system; who renders; which clock |
| `set_aside_reason` | `run` | why an unfinished run was set aside for this one, where a reason was given |
| `experimenter_knows` | `run`, `resumed` | what the experimenter could not be kept from knowing: direction, dampers |
| `body` | `step`, `outcome`, `remark` | what should happen, what did, what was said beside it; its `kind` says which |
| `body.kind` | `remark` | `answer-corrected`, `rating-corrected`, `description-corrected`, `flagged`, `noted`, \
`paused` (`cause`: of itself, for what), `continued`, `refused`, `halted`, `halt-reason`, `test-shot` |
| `body.event`, `state`, `because`, `by` | `remark` | of a `refused` press: for what it was, in which state, \
why it was not taken, whose hand |
| `body.by` | `remark` | of a `halted` run: at whose screen the emergency stop was pressed |
| `body.held_s`, `cause` | `remark` | of a `test-shot` after an emergency stop: how long the key was held; \
empty `cause`: it was fired |
| `body.cause`, `shots`, `exposure_s` | `outcome` | of an `interrupted` stimulus: `pause` or `break-off`; how long \
it was felt, where that is known |
| `body` | `shot` | one shot of a train, from 1, with its times; kept also if the train fails or is stopped |
| `body.timing` | `outcome`, `shot` | of a gun on a line: request, write, acknowledgement, pulse, on both clocks |
| `body.timing.gun_count` | `outcome`, `shot` | the gun's count since its reset; a gap: a shot of unknown outcome |
| `body.key_time_s` | `outcome` | when a synthetic participant's key went down (`--visual`), in s since the onset |
| `shown_s` | `outcome` | when the console had painted the step, where there was a console |
| `reason` | `stopped` | why the run stopped before its end |
| `cut_bytes`, `stopped_utc` | `resumed` | bytes of a record cut off at the end, and when the run had stopped |
| `table_sha256` | `finished` | hash of the table, by which an edited table is noticed |

Canonical JSON: UTF-8, keys sorted, no blanks, no NaN, floats in shortest round-trip form.

## `participants.jsonl`

The register of a results folder, beside the `sub-<ID>` folders and readable by its owner only: who joined, with the
facts that the study asks for, who is excluded, and whose unfinished run was set aside. Codes only, never names.
Appended, synced and chained like a journal; `recoil study` shows and changes it. A later `joined` of the same code
corrects the facts of the earlier one; the last of `excluded` and `readmitted` counts. Who is excluded keeps their
files, but gives their row of the balancing square back.

| key | in | meaning |
| --- | --- | --- |
| `n` | every record | number of the record, from 0 |
| `kind` | every record | `joined`, `excluded`, `readmitted` or `set-aside` |
| `utc` | every record | date and time (UTC, ISO 8601) when it was written |
| `link` | every record | first 16 digits of the SHA-256 of the line before; empty in the first |
| `participant_id` | every record | participant's code, 1 to 32 letters and digits |
| `facts.age_years` | `joined` | age in whole years, 1 to 120; `null` if it was not asked |
| `facts.sex` | `joined` | `female`, `male`, `other`, `undisclosed`; `null` if it was not asked |
| `facts.handedness` | `joined` | `right`, `left`, `both`; `null` if it was not asked |
| `experiment` | `set-aside` | of which experiment an unfinished run was set aside for a fresh one |
| `reason` | `excluded`, `readmitted`, `set-aside` | why, in one line of at most 200 characters; no name |

## What `recoil analyze` writes

`statistics.json`: nothing is rounded; rates 0 to 1; SD with n - 1; `null` where a number is undefined, with a `reason`
or a line in `warnings` that says why. Under `direction` and `preference`:

| key | meaning |
| --- | --- |
| `n`, `methods` | complete participants; methods in their order |
| `means`, `sds`, `participants`, `within_ci` | of correct rates (forward) or ratings; Cousineau-Morey 95 % intervals |
| `anova` | repeated-measures ANOVA: `F`, `df` [effect, error], `p`, sums of squares |
| `tukey`, `tukey_paired` | all pairs: pooled error term (the paper's); each pair's own; simultaneous intervals |
| `sphericity` | Mauchly's test; Greenhouse-Geisser and Huynh-Feldt epsilon with corrected `df` and `p` |
| `effect_size` | partial eta squared with intervals, generalised eta squared |
| `friedman`, `paired_t`, `bayes_factors` | rank test and post-hoc; paired t-tests, Holm; JZS factors |
| `diagnostics` | normality of the residuals, outliers by participant, scores at the ends of the scale |
| `assumptions` | what was assumed, and a warning where it does not hold |
| `origin` | whose hand gave how many answers, and which guns rendered the trials |
| `backward`, `sensitivity` | rates on backward shots; d' and criterion, log-linear corrected (direction only) |
| `binomial` | pooled exact tests: `p`, `log_p`, Clopper-Pearson and Wilson intervals, `clustering` |
| `model` | logistic GEE of the forward answers with a bias-reduced sandwich (direction only) |
| `response_time`, `response_times` | of times from the participant's own hand alone (direction only) |
| `speed_accuracy` | of these, by method and instruction: `methods`, `instruction_effects`, `diffusion` |
| `speed_accuracy.refused` | answered trials whose times are nobody's own, by reason; `caveats`: what each number is |

Beside them: `excluded` (who, where, why), `rules` (what was dropped by which rule), `studies` (each study's own
statistics, where there are several), `warnings`, `versions`.

`direction_long.csv`, `preference_long.csv`: a row a participant and method. `direction_wide.csv`,
`preference_wide.csv`: a row a participant, `<method>_<measure>` as columns, `-` as `_`.

| column | meaning |
| --- | --- |
| `study`, `participant_id`, `method` | the results folder; the code; the rendering method (long tables) |
| `trials_forward`, `correct_forward`, `rate_forward` | trials, correct answers, their share; likewise `backward` |
| `response_time_median_s` | median of the participant's own valid response times |
| `rating`, `order` | the rating from 0 to 10; the place in the order of presentation |
"""


def dictionary() -> str:
    """The data dictionary as Markdown."""
    tables = "\n".join(line for experiment in TABLES for line in _table(experiment))
    return f"{_HEAD}\n{tables}\n{_TAIL}"


def _table(experiment: str) -> Iterator[str]:
    yield f"## `sub-<ID>_task-{experiment}_{FILE_SUFFIX[experiment]}.csv`\n"
    yield "| column | type | values | meaning |"
    yield "| --- | --- | --- | --- |"
    for column in TABLES[experiment]:
        yield f"| `{column.name}` | {column.type} | {_values(column)} | {column.description} |"
    yield ""


def _values(column: Column) -> str:
    levels = ", ".join(f"`{level}`" for level in column.levels)
    return levels + (" or empty" if levels and not column.required else "")


if __name__ == "__main__":
    sys.stdout.write(dictionary())
