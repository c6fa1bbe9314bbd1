"""Long and wide force logs take time and memory in proportion to their length."""

import tracemalloc
from itertools import pairwise

import numpy as np
import pytest

from pipeline.errors import InputError
from pipeline.intake.columns import find_columns
from pipeline.intake.forcelog import read_force_log
from pipeline.intake.holds import Run, _hold
from pipeline.intake.samples import Samples
from pipeline.intake.specimenfile import LogSpec
from pipeline.intake.table import read_table
from pipeline.settings.intake import IntakeSettings
from tests.pipeline.intake.timing import spent

SETTINGS = IntakeSettings()
HEAD = "step,branch,time_s,displacement_mm,force_N,image\n"
FOUR = 8.0
"""Ratio of the times for four times the work: 4 where it is linear, 16 where it is quadratic; half-way between."""


def read(text):
    columns, rows = find_columns(HEAD + text, LogSpec())
    return read_table(rows, columns)


def test_summary_rows_are_looked_for_once():
    def rows(count):
        return "0,loading,1,2,3,\n" * count

    assert spent(read, rows(60_000)) < FOUR * spent(read, rows(15_000))


def test_rows_of_means_below_a_table_are_told_from_those_within():
    sample, mean, remark = "0,loading,1,2,3,\n", "mean,,,1,2,\n", ",,,,x,\n"
    table = read(sample + mean + sample + sample + remark + mean + mean)
    assert list(table.lines) == [2, 3, 4, 5]
    assert table.summary == (6, 7, 8)
    assert table.cells["force"] == ["3", "2", "3", "3"]
    nothing_else = read(mean + mean)  # refused cell by cell
    assert list(nothing_else.lines) == [2, 3] and nothing_else.summary == ()


def test_rows_without_a_displacement_of_their_own_are_no_remarks_where_most_are():
    """A log of one hold that names its displacement once: the other rows carry it down."""
    table = read("1,loading,1,4.0,2.31,\n1,loading,2,,2.32,\n1,loading,3,,2.33,\n")
    assert table.cells["force"] == ["2.31", "2.32", "2.33"] and table.summary == ()


def test_of_a_long_log_no_cell_is_kept_that_has_no_role_or_is_that_above():
    """A million rows took 760 MB, now 360: each of their six cells was a text of its own, and so were their lines."""
    text = "".join(f"{k // 5000},loading,{k},{k // 5000},{k % 977},,remark {k}\n" for k in range(20_000))
    columns, rows = find_columns(HEAD.replace("\n", ",notes\n") + text, LogSpec())
    tracemalloc.start()
    table = read_table(rows, columns)
    kept = tracemalloc.get_traced_memory()[0]
    tracemalloc.stop()
    # times and forces of 54 bytes; eight of a pointer for six cells and the place of a row, lists an eighth longer
    assert kept / len(table.places) < 2 * 54 + 7 * 8 * 1.13 + 4
    assert len({id(cell) for cell in table.cells["step"]}) == 4
    assert list(table.others({0, 1, 2, 3, 4, 5}))[-1] == "remark 19999"


@pytest.mark.parametrize("cell", ["[", "(", "( ", "[(", "/ ", "in ", "a[", "_", "_ "])
def test_a_header_of_brackets_takes_time_in_proportion(cell):
    def read(count):
        text = f"force_N;displacement_mm;{cell * count}x\n1;2;3\n"
        find_columns(text, LogSpec())

    assert spent(read, 16_000) < FOUR * spent(read, 4_000)


def test_a_line_of_separators_alone_is_no_table_of_a_million_columns():
    def read(count):
        find_columns("a," * count + "\n" + HEAD + "0,loading,0,0,0,\n", LogSpec())

    assert spent(read, 40_000) < FOUR * spent(read, 10_000)
    columns, rows = find_columns("a," * 10**5 + "\n" + HEAD, LogSpec())
    assert columns.header_line == 2
    assert len(rows[0][1]) == 1001
    assert [len(row) for _, row in rows] == [1001, 6]


def test_more_steps_than_anybody_holds_are_refused(tmp_path):
    path = tmp_path / "force.csv"
    path.write_text("step,displacement_mm,force_N\n" + "".join(f"{k},{k},{k % 7}\n" for k in range(1, 12_000)))
    with pytest.raises(InputError, match=r"holds 11999 steps, the limit is 10000; give all rows of one hold the same"):
        read_force_log(path, LogSpec(), SETTINGS)


def test_a_hold_without_times_keeps_its_own_numbers_alone():
    """Each step kept the numbers of all samples: 50,000 steps of one row took 19 GB."""
    lines, forces = tuple(range(1000)), np.ones(1000)
    samples = Samples(lines, forces, forces, None, None, None, ("",) * 1000, 0.1, ())
    times = _hold(samples, forces, Run(5, 8, 0)).times
    assert list(times) == [5.0, 6.0, 7.0]
    assert times.base is None or times.base.size == 3


def test_zeros_with_an_absurd_power_of_ten_are_zeros(specimen_folder):
    log = "step,displacement_mm,force_N,image\n0,0,0e999,step_0.png\n1,4,2e0,step_1.png\n2,8,3e0,step_2.png\n"
    assert specimen_folder(log=log).read().steps[0].force_N == 0.0
    path = specimen_folder(log="displacement_mm,force_N\n0,0e999\n4,0e999\n", name="zeros").path / "force.csv"
    with pytest.raises(InputError):  # stands still, as a log of zeros does
        read_force_log(path, LogSpec(), SETTINGS)


def test_wild_forces_within_wild_forces_end(tmp_path):
    """Each that is left out lowers the largest median, by which the next is wild: a chain as long as the log."""
    level = [100.0 - 0.5 * k for k in range(60)]
    wild = [300.0, *(here + (here + above) / 2.0 for above, here in pairwise(level))]
    rows = [f"{k},{k},{force:.3f}" for k in range(60) for force in (0.0, 0.0, level[k], level[k], wild[k])]
    path = tmp_path / "force.csv"
    path.write_text("step,displacement_mm,force_N\n" + "\n".join(rows) + "\n")
    log = read_force_log(path, LogSpec(), SETTINGS)
    assert sum(finding.code == "log/wild-force" for finding in log.findings) == 10


def test_a_complaint_about_a_long_header_is_short():
    with pytest.raises(InputError) as refused:
        find_columns("step," + "[" * 16_000 + "\n1,2\n", LogSpec())
    assert len(str(refused.value.said)) < 500
