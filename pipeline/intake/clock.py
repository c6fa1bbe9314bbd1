"""Times as clocks write them -> seconds: ``12:03:04,5``, ``21.11.26 08:01:02``, ISO dates with or without a zone.

Only differences count. Stamps with a zone are compared in UTC, so a log goes on through the end of summer time; times
of the day without a date go on through midnight.
"""

from __future__ import annotations

import datetime as dt
import re

import numpy as np

from pipeline.records import Array

CLOCK = re.compile(r"(?:(\d{1,3}):)?(\d{1,2}):(\d{1,2}(?:[.,]\d+)?)", re.ASCII)
GERMAN_DATE = re.compile(
    r"(\d{1,2})\.(\d{1,2})\.((?:20)?\d\d)[ T]+(\d{1,2}:\d{1,2}(?::\d{1,2})?)(?:[.,](\d+))?", re.ASCII
)
ISO_DATE = re.compile(r"(\d{4})[-/](\d\d)[-/](\d\d)([ T]\d\d:\d\d.*)", re.ASCII)
DAY_S = 86400.0


def clock_s(cell: str) -> float | None:
    """Seconds of a time of the day, or of a date with time from an epoch; None for anything else."""
    if found := CLOCK.fullmatch(cell):
        return 3600.0 * float(found[1] or 0) + 60.0 * float(found[2]) + float(found[3].replace(",", "."))
    if found := GERMAN_DATE.fullmatch(cell):
        year, part = f"20{found[3][-2:]}", found[5]
        cell = f"{year}-{found[2]:0>2}-{found[1]:0>2} {found[4]:0>5}" + (f".{part[:6]:0<6}" if part else "")
    elif found := ISO_DATE.fullmatch(cell):
        cell = "-".join(found.groups()[:3]) + found[4]
    else:
        return None
    try:
        stamp = dt.datetime.fromisoformat(cell)
    except ValueError:
        return None
    aware = stamp if stamp.tzinfo else stamp.replace(tzinfo=dt.UTC)
    return (aware - dt.datetime(2000, 1, 1, tzinfo=dt.UTC)).total_seconds()


def through_midnight(times: Array) -> Array:
    """Times of the day, s (n,), a day added wherever they fall back by more than half of one."""
    if times.size and float(np.max(times)) < DAY_S:
        return times + DAY_S * np.concatenate([[0.0], np.cumsum(np.diff(times) < -0.5 * DAY_S)])
    return times
