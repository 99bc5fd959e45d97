"""Dates and times for people: local, in one format. Files keep UTC."""

from __future__ import annotations

from datetime import datetime, tzinfo

_DAYS = ("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun")
_MONTHS = ("Jan", "Feb", "Mar", "Apr", "May", "Jun", "Jul", "Aug", "Sep", "Oct", "Nov", "Dec")
"""In the language of the screens, whatever language the system speaks."""


def date_text(utc: str, zone: tzinfo | None = None) -> str:
    """Date and time of a record (ISO 8601) in local time; what is no date is given back as it is.

    >>> from datetime import timedelta, timezone
    >>> date_text("2026-11-22T01:09:58.895306Z", timezone(timedelta(hours=2)))
    'Sun 22 Nov 2026, 03:09'
    """
    try:
        moment = datetime.fromisoformat(utc).astimezone(zone)
    except (ValueError, OverflowError):
        return utc
    day = f"{_DAYS[moment.weekday()]} {moment.day} {_MONTHS[moment.month - 1]} {moment.year}"
    return f"{day}, {time_text(moment)}"


def time_text(moment: datetime) -> str:
    """The time of day: `14:05`."""
    return f"{moment:%H:%M}"
