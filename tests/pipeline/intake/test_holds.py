"""Rows to steps: numbers, branches and signs that are inferred, and contradictions that are told."""

import numpy as np
import pytest

from pipeline.errors import InputError
from pipeline.intake.forcelog import read_force_log
from pipeline.intake.specimenfile import LogSpec
from pipeline.settings.intake import IntakeSettings

NOISE = (0.001, -0.002, 0.001)
FORCES = {0.0: 0.0, 2.0: 1.6, 5.0: 2.3, 9.0: 2.6, 14.0: 2.75}
UP = (0.0, 2.0, 5.0, 9.0, 14.0)
DOWN = (9.0, 5.0, 2.0)


def log_text(displacements, *, columns=("step", "branch"), sign=1.0, towards=1.0, ramp=0):
    """A log of three samples a hold, steps of uneven size; ``ramp``: rows on the way between the holds."""
    lines = [",".join((*columns, "displacement_mm", "force_N", "image"))]
    before = 0.0
    for number, at in enumerate(displacements):
        branch = "mounted" if number == 0 and at == 0.0 else "loading" if at > before else "unloading"
        told = {"step": number, "branch": branch, "time_s": 0}
        for part in range(1, ramp + 1):
            way = before + (at - before) * part / (ramp + 1)
            lines.append(",".join([*(str(told[c]) for c in columns), f"{towards * way:.3f}", f"{sign:.3f}", ""]))
        for row, noise in enumerate(NOISE):
            image = f"p{number}.png" if row == 2 else ""
            force = sign * (FORCES[at] + noise)
            lines.append(",".join([*(str(told[c]) for c in columns), f"{towards * at:.3f}", f"{force:.4f}", image]))
        before = at
    return "\n".join(lines)


@pytest.fixture
def read(tmp_path):
    def reader(text, **spec):
        path = tmp_path / "force.csv"
        path.write_text(text)
        return read_force_log(path, LogSpec(**spec), IntakeSettings())

    return reader


def codes(log):
    return [finding.code for finding in log.findings]


def displacements_mm(log):
    return [round(step.displacement_m * 1e3, 6) for step in log.steps]


@pytest.mark.parametrize("columns", [("step", "branch"), ("step",), ("branch",), ()])
def test_steps_and_branches_written_or_inferred(columns, read):
    log = read(log_text(UP + DOWN, columns=columns))
    assert displacements_mm(log) == list(UP + DOWN)
    assert [step.branch for step in log.steps] == ["mounted"] + ["loading"] * 4 + ["unloading"] * 3
    assert [step.image for step in log.steps] == [f"p{n}.png" for n in range(8)]
    assert ("log/branch-inferred" in codes(log)) == ("branch" not in columns)
    assert ("log/steps-inferred" in codes(log)) == ("step" not in columns)


def test_ramps_between_holds_are_no_steps(read):
    log = read(log_text(UP, columns=(), ramp=2))
    assert displacements_mm(log) == list(UP)
    assert "8 shorter ones" in next(f.message for f in log.findings if f.code == "log/steps-inferred")


def test_ramps_sampled_often_are_no_steps(read):
    """A slow ramp stands on each displacement for several samples, fewer than the holds."""
    lines = log_text(UP, columns=()).splitlines()
    slow = [lines[0]]
    before = 0.0
    for at, rows in zip(UP, zip(*[iter(lines[1:])] * 3, strict=True), strict=True):
        ramp = np.linspace(before, at, 1000, endpoint=False)[1:] if at else []
        slow += [f"{way:.4f},1.0," for way in ramp]
        slow += [row for row in rows for _ in range(20)]
        before = at
    log = read("\n".join(slow))
    assert displacements_mm(log) == list(UP)
    assert "no step numbers; 5 stretches" in next(f.message for f in log.findings if f.code == "log/steps-inferred")


def test_a_test_that_begins_loaded_has_no_mounted_step(read):
    log = read(log_text(UP[1:], columns=("step",)))
    assert [step.branch for step in log.steps] == ["loading"] * 4


def test_force_at_displacement_zero_is_not_force_free(read):
    text = (
        log_text(UP, columns=("step",)).replace("0,0.000,0.00", "0,0.000,1.00").replace("0,0.000,-0.00", "0,0.000,1.00")
    )
    assert read(text).steps[0].branch == "loading"


def test_sign_of_the_force_is_inferred_aloud(read):
    log = read(log_text(UP, sign=-1.0))
    assert log.steps[-1].force_N == pytest.approx(2.75)
    finding = next(f for f in log.findings if f.code == "log/force-sign")
    assert finding.level == "warning"
    assert "3 of 3 bent steps" in finding.message  # 2 of 14 mm is less than a fifth of the way


def test_sign_of_the_force_as_the_user_says(read):
    log = read(log_text(UP, sign=-1.0), force_sign="tension")
    assert log.steps[-1].force_N == pytest.approx(2.75)
    assert "log/force-sign" not in codes(log)


@pytest.mark.parametrize(("sign", "said"), [(-1.0, "compression"), (1.0, "tension")])
def test_a_sign_by_which_a_pushed_cable_would_pull_is_reversed_and_told(sign, said, read):
    log = read(log_text(UP, sign=sign), force_sign=said)
    assert log.steps[-1].force_N == pytest.approx(2.75)
    (finding,) = (f for f in log.findings if f.code == "log/force-sign")
    other = {"tension": "compression", "compression": "tension"}[said]
    assert f'by force_sign = "{said}" in [rig] the bent steps would pull' in finding.message
    assert finding.message.endswith(f'set force_sign = "{other}"')


def test_displacement_that_counts_downward(read):
    log = read(log_text(UP, towards=-1.0, columns=("step",)))
    assert displacements_mm(log) == list(UP)
    assert "log/displacement-sign" in codes(log)


@pytest.mark.parametrize("towards", [1.0, -1.0])
def test_a_machine_that_counts_from_the_end_of_its_own_way(towards, read):
    lines = log_text(UP + DOWN).splitlines()
    cells = [line.split(",") for line in lines]
    far = [",".join([*c[:2], f"{250.0 + towards * float(c[2]):.3f}", *c[3:]]) for c in cells[1:]]
    log = read("\n".join([lines[0], *far]))
    assert displacements_mm(log) == list(UP + DOWN)
    assert codes(log) == ["log/displacement-zero"] + ["log/displacement-sign"] * (towards < 0.0)


def test_zero_that_is_a_little_off_stays(read):
    """What is off by less than the travel is an error of the zero: the diagnosis names it, nobody corrects it."""
    log = read(log_text(UP).replace("mounted,0.000", "mounted,0.300"))
    assert displacements_mm(log)[0] == 0.3
    assert codes(log) == ["steps/branch"]


def test_clean_log_has_no_findings(read):
    assert codes(read(log_text(UP + DOWN))) == []


def test_missing_step(read):
    text = "\n".join(line for line in log_text(UP).splitlines() if not line.startswith("2,"))
    log = read(text)
    assert codes(log) == ["steps/missing"]
    assert "step 3 follows step 1" in log.findings[0].message


def test_doubled_step_under_another_number(read):
    text = log_text(UP)
    again = [line.replace("2,loading", "20,loading", 1) for line in text.splitlines() if line.startswith("2,")]
    lines = text.splitlines()
    place = lines.index(next(line for line in lines if line.startswith("3,")))
    log = read("\n".join(lines[:place] + again + lines[place:]))
    assert "steps/doubled" in codes(log)


def test_a_number_that_comes_back_is_another_step(read):
    text = log_text(UP + DOWN)
    for number, level in ((5, 3), (6, 2), (7, 1)):  # the unloading steps carry the numbers of the levels
        text = text.replace(f"\n{number},", f"\n{level},")
    log = read(text)
    assert displacements_mm(log) == list(UP + DOWN)
    assert [step.step for step in log.steps] == list(range(8))
    assert codes(log) == ["log/steps-renumbered"]


def test_branch_against_the_displacements(read):
    log = read(log_text(UP).replace("3,loading", "3,unloading"))
    assert "steps/branch" in codes(log)


def test_displacement_that_moves_within_a_step(read):
    log = read(log_text(UP).replace("2,loading,5.000,2.2980", "2,loading,4.000,2.2980"))
    assert codes(log) == ["steps/displacement-spread"]
    assert displacements_mm(log)[2] == 5.0


def test_two_photos_in_one_hold(read):
    log = read(log_text(UP).replace("2.3010,", "2.3010,early.png"))
    assert "photo/several" in codes(log)
    assert log.steps[2].image == "early.png"


def test_a_wild_force_is_left_out_and_its_photo_kept(read):
    """A slipped digit among samples that agree; what four samples cannot decide stays."""
    lines = log_text(UP).splitlines()
    many = "\n".join([lines[0], *(line for row in lines[1:] for line in (row.rsplit(",", 1)[0] + ",", row))])
    log = read(many.replace("2.6010,p3.png", "2601.0,p3.png"))
    assert codes(log) == ["log/wild-force"]
    assert "line 25" in log.findings[0].message
    assert log.steps[3].image == "p3.png"
    assert log.steps[3].force_N == pytest.approx(np.mean([2.601, 2.601, 2.598, 2.598, 2.601]))
    assert codes(read("\n".join(lines).replace("2.6010,p3.png", "2601.0,p3.png"))) == []


def test_swapped_columns_are_refused(read):
    text = log_text(UP).replace("displacement_mm,force_N", "force_N,displacement_mm")
    with pytest.raises(InputError) as refused:
        read(text)
    assert refused.value.code == "log/swapped-columns"


def test_lines_lead_back_to_the_file(read):
    log = read("Protokoll 7\n\n" + log_text(UP))
    assert [step.line for step in log.steps] == [4 + 3 * n for n in range(5)]


def test_forces_are_kept_as_they_are_read(read):
    log = read(log_text(UP))
    np.testing.assert_allclose(log.steps[3].forces_N, [2.601, 2.598, 2.601], rtol=1e-12)
