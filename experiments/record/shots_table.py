"""The table of what a sensor measured: one row a shot, where a run had a sensor. Pure.

It is a table of its own, as a trial may have several shots, and as others know the columns of the table of trials.
"""

from __future__ import annotations

from dataclasses import asdict
from datetime import datetime, timedelta
from typing import get_args

from experiments.clock import utc_text
from experiments.design.plan import Plan, Trial
from experiments.record import tables
from experiments.record.tables import Row, level_column, number_column, text_column
from experiments.session.history import History
from experiments.session.remarks import DeliveryMark, ShotMeasured
from experiments.session.steps import Fired, FireShot, Present, Presented

_MARKS = tuple(mark for mark in get_args(DeliveryMark) if mark)

SHOTS = (
    tables.PARTICIPANT,
    text_column("experiment", "which experiment", required=True),
    tables.integer_column("session", "session, from 1", required=True),
    tables.integer_column("set", "set within the session, from 1", required=True),
    tables.integer_column("trial", "trial within the session, from 1", required=True),
    tables.integer_column("attempt", "presentation of the trial, from 1", required=True),
    tables.integer_column("interval", "interval of the trial, from 1", required=True),
    tables.integer_column("shot", "shot of the presentation, from 1", required=True),
    text_column("onset_utc", "date and time (UTC, ISO 8601) of the pulse; empty where the presentation was broken off"),
    text_column("method", "rendering method", required=True),
    text_column("sensor", "what measured it, as `--sensor` has it"),
    level_column(
        "mark",
        _MARKS,
        "`no-peak`: none showed; `outside`: this shot is not what the model allows; `slipped`: the last ones together "
        "are not; `not-measured`; empty: as it should be",
    ),
    text_column("because", "why there is a mark"),
    number_column("delivered_onset_s", "s", "from the gun's own onset of the pulse to the measured one"),
    number_column("delivered_onset_uncertainty_s", "s", "its standard uncertainty"),
    number_column("delivered_peak_m_s2", "m/s2", "largest acceleration of the recoil"),
    number_column("delivered_peak_uncertainty_m_s2", "m/s2", "its standard uncertainty"),
    number_column("expected_peak_m_s2", "m/s2", "the same by the model, in a hand as assumed"),
    number_column(
        "delivered_friction_N",
        "N",
        "mean friction of the magnet, out and back, with the sensor's scale by the run's first peaks; empty where no "
        "step shows",
    ),
    number_column("delivered_friction_uncertainty_N", "N", "its standard uncertainty"),
    number_column("expected_friction_N", "N", "the same by the model, in a hand as assumed"),
)
"""The columns of `sub-<ID>_task-<experiment>_shots.csv`."""

_FIELDS = {
    "onset_s": "delivered_onset_s",
    "onset_u_s": "delivered_onset_uncertainty_s",
    "peak_m_s2": "delivered_peak_m_s2",
    "peak_u_m_s2": "delivered_peak_uncertainty_m_s2",
    "friction_N": "delivered_friction_N",
    "friction_u_N": "delivered_friction_uncertainty_N",
}


def shot_rows(plan: Plan, history: History) -> list[Row]:
    """One row a shot that a sensor was asked about, in order."""
    shots = [word for _, word in history if isinstance(word, ShotMeasured)]
    first_s = {_presentation(one): one.pulse_start_s for one in shots if one.shot == 1}
    begun = {
        _presentation(step): datetime.fromisoformat(word.onset_utc)
        for step, word in history
        if isinstance(word, Fired | Presented) and isinstance(step, FireShot | Present)
    }
    return [_row(plan, one, begun.get(_presentation(one)), first_s.get(_presentation(one))) for one in shots]


def _presentation(of: FireShot | Present | ShotMeasured) -> tuple[Trial, int, int]:
    return of.trial, of.attempt, 0 if isinstance(of, Present) else of.interval


def _row(plan: Plan, shot: ShotMeasured, begun: datetime | None, first_s: float | None) -> Row:
    fields = {_FIELDS.get(key, key): value for key, value in asdict(shot).items()}
    trial = {"session": shot.trial.session, "set": shot.trial.set, "trial": shot.trial.trial}
    who = {"participant_id": plan.participant_id, "experiment": plan.experiment}
    onset = None
    if begun is not None and first_s is not None:
        onset = utc_text(begun + timedelta(seconds=shot.pulse_start_s - first_s))
    interval, mark = shot.interval + 1, shot.mark or None
    return {**fields, **who, **trial, "interval": interval, "mark": mark, "onset_utc": onset}
