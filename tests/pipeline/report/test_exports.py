"""Files for simulation programs, read back by parsers of their own, and by the programs where they are installed."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner

from pipeline.cli import main
from pipeline.cli.export import NAMES
from pipeline.report.curves import equivalent
from pipeline.report.exports import DENSITY, FORMATS, beam_table, export
from pipeline.report.frames import beam_frame, simulation_frame
from pipeline.report.tables import write_result
from pipeline.result import FindingPart
from tests.pipeline.report.virtual_result import DIAMETER, K0, LENGTH, moment_of

INERTIA = np.pi * DIAMETER**4 / 64.0


def keywords(text):
    """An input deck as (keyword, parameters, rows of numbers): comments start with two stars, keywords with one."""
    blocks = []
    for line in text.splitlines():
        if line.startswith("*") and not line.startswith("**"):
            name, *parameters = (part.strip() for part in line[1:].split(","))
            blocks.append((name, dict((p.partition("=")[::2]) for p in parameters), []))
        elif line.strip() and not line.startswith("**"):
            blocks[-1][2].append([float(cell) for cell in line.split(",")])
    return blocks


def numbers(text):
    return np.array([float(word) for word in text.split()])


@pytest.fixture(scope="module")
def stiffness(full_result):
    return equivalent(full_result.answer.curve).stiffness


def test_a_beam_table_starts_at_rest_and_follows_the_law(full_result):
    table = beam_table(full_result.answer.curve)
    assert (table.bend_per_m.to_numpy()[0], table.moment_Nm.to_numpy()[0]) == (0.0, 0.0)
    assert np.all(np.diff(table.bend_per_m.to_numpy()) > 0.0) and table.measured.all()
    # the curve of the virtual result is the law itself plus the stated error of K0, four standard deviations of it
    law = moment_of(K0 + table.bend_per_m.to_numpy())
    assert np.abs(table.moment_Nm.to_numpy() - law).max() < 4 * 0.013 * 20e-3 + 0.03 * law.max()


def test_the_other_side_is_added_where_the_cable_is_straight_at_rest(full_result):
    curve = full_result.answer.curve
    straight = replace(curve, kappa=curve.kappa - curve.pre_curvature, pre_curvature=0.0)
    table = beam_table(straight)
    assert np.array_equal(table.bend_per_m.to_numpy(), -table.bend_per_m.to_numpy()[::-1]) and np.array_equal(
        table.moment_Nm.to_numpy(), -table.moment_Nm.to_numpy()[::-1]
    )
    assert np.array_equal(table.measured == 1, table.bend_per_m.to_numpy() >= 0.0)
    assert len(beam_table(curve, both_sides=True)) == len(table)
    assert beam_table(curve).bend_per_m.to_numpy()[0] == 0.0  # bent at rest: its two sides may differ


def test_the_frame_is_the_table(full_result, failed_result):
    table, frame = beam_table(full_result.answer.curve), beam_frame(full_result)
    assert np.array_equal(frame.bend_per_m, table.bend_per_m.to_numpy()) and np.array_equal(
        frame.moment_Nm, table.moment_Nm.to_numpy()
    )
    assert beam_frame(failed_result).empty and list(beam_frame(failed_result)) == list(frame)


def test_a_plain_table(full_result):
    lines = export(full_result, "table").splitlines()
    head = [line for line in lines if line.startswith("# ")]
    assert lines[len(head)] == "bend_per_m\tmoment_Nm"
    read = np.array([line.split("\t") for line in lines[len(head) + 1 :]], float)
    table = beam_table(full_result.answer.curve, both_sides=True)
    assert read == pytest.approx(table[["bend_per_m", "moment_Nm"]].to_numpy(), rel=1e-8)


def test_an_abaqus_section_holds_the_curve(full_result, stiffness):
    blocks = keywords(export(full_result, "abaqus"))
    assert [name for name, _, _ in blocks] == ["BEAM GENERAL SECTION", "AXIAL", "M1", "M2", "TORQUE"]
    section, axial, one, two, torque = blocks
    assert section[1] == {"SECTION": "NONLINEAR GENERAL", "ELSET": "CABLE", "DENSITY": "1000.0"}
    area = np.pi * DIAMETER**2 / 4.0
    assert section[2] == [pytest.approx([area, INERTIA, 0.0, INERTIA, 2.0 * INERTIA], rel=1e-8)]
    table = beam_table(full_result.answer.curve, both_sides=True)
    assert one == ("M1", {"ELASTIC": ""}, one[2]) and one[2] == two[2]
    assert np.array(one[2]) == pytest.approx(table[["moment_Nm", "bend_per_m"]].to_numpy(), rel=1e-8)
    assert (axial[1], torque[1]) == ({"LINEAR": ""}, {"LINEAR": ""})
    assert torque[2][0][0] == pytest.approx(stiffness, rel=1e-8)


def test_a_calculix_section_bends_by_the_equivalent_stiffness(full_result, stiffness):
    blocks = {name: (parameters, rows) for name, parameters, rows in keywords(export(full_result, "calculix"))}
    parameters, ((area, i11, i12, i22, shear), direction) = blocks["BEAM SECTION"]
    assert parameters == {"ELSET": "CABLE", "MATERIAL": "CABLE", "SECTION": "GENERAL"}
    assert (i12, i22, len(direction)) == (0.0, i11, 3) and 0.0 < shear <= 1.0 and area > 0.0
    ((young, poisson),) = blocks["ELASTIC"][1]
    assert young * i11 == pytest.approx(stiffness, rel=1e-7) and poisson == 0.0
    assert blocks["DENSITY"][1] == [[DENSITY]]


def test_a_mujoco_cable_rests_on_an_arc_of_the_right_stiffness(full_result, stiffness):
    cable = ElementTree.fromstring(export(full_result, "mujoco")).find("worldbody/flexcomp")
    nodes = numbers(cable.get("point")).reshape(-1, 3)
    steps = np.diff(nodes, axis=0)
    turns = np.unwrap(np.arctan2(steps[:, 2], steps[:, 0]))
    pieces = np.linalg.norm(steps, axis=1)
    # chords of an arc are shorter than it by (K0 ds)^2 / 24, 8e-6 here
    assert pieces.sum() == pytest.approx(LENGTH, rel=1e-5)
    # and the ninth digit of a node turns a piece by 1e-7 of a right angle
    assert np.diff(turns) / pieces[1:] == pytest.approx(full_result.answer.pre_curvature_per_m, rel=2e-5)
    assert numbers(cable.get("element")).tolist() == [n for i in range(len(steps)) for n in (i, i + 1)]
    young, radius = float(cable.find("elasticity").get("young")), float(cable.get("radius"))
    assert young * np.pi * radius**4 / 4.0 == pytest.approx(stiffness, rel=1e-7)


def test_a_pyelastica_module_makes_the_rod_it_says(full_result, stiffness, monkeypatch):
    made = []

    class Rod:
        def __init__(self, elements, young, radius):
            self.rest_kappa = np.zeros((3, elements - 1))
            self.stiffness = young * np.pi * radius**4 / 4.0

        @classmethod
        def straight_rod(
            cls, elements, _, direction, normal, length, radius, density, *, youngs_modulus, shear_modulus
        ):
            assert abs(direction @ normal) < 1e-12 and (length, density) == (LENGTH, DENSITY)
            assert shear_modulus == pytest.approx(youngs_modulus / 2.0)
            made.append(cls(elements, youngs_modulus, radius))
            return made[-1]

    module = type("elastica", (), {"CosseratRod": Rod})
    monkeypatch.setitem(__import__("sys").modules, "elastica", module)
    names = {}
    exec(compile(export(full_result, "pyelastica"), "cable.py", "exec"), names)
    rod = names["cable"](20)
    assert rod is made[0] and rod.stiffness == pytest.approx(stiffness, rel=1e-7)
    assert rod.rest_kappa[0] == pytest.approx(full_result.answer.pre_curvature_per_m)
    assert not rod.rest_kappa[1:].any()


def test_mujoco_bends_it_by_the_deflection_of_a_cantilever(full_result, stiffness):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(export(full_result, "mujoco").replace("<option", '<option gravity="0 0 0"'))
    data, force = mujoco.MjData(model), 0.005
    mujoco.mj_forward(model, data)
    tip, across = data.flexvert_xpos[-1].copy(), np.array([-np.sin(K0 * LENGTH), 0.0, np.cos(K0 * LENGTH)])
    data.xfrc_applied[model.flex_vertbodyid[-1], :3] = force * across
    for _ in range(8000):
        mujoco.mj_step(model, data)
    # bends at the inner nodes j turn what lies beyond by F d_j h / EI, d_j the lever of the force about node j
    nodes = data.flexvert_xpos.copy()
    levers = (tip - nodes[1:-1]) @ np.array([np.cos(K0 * LENGTH), 0.0, np.sin(K0 * LENGTH)])
    expected = force * np.sum(levers**2) * LENGTH / (len(nodes) - 1) / stiffness
    # second order in the rotations, (deflection / length)^2, below 1e-3 here; what the soft edges add is less than 1 %
    assert (data.flexvert_xpos[-1] - tip) @ across == pytest.approx(expected, rel=0.01)


def test_pyelastica_has_the_stiffness_in_its_rod(full_result, stiffness):
    pytest.importorskip("elastica")
    names = {}
    exec(compile(export(full_result, "pyelastica"), "cable.py", "exec"), names)
    rod = names["cable"]()
    assert rod.bend_matrix[0, 0] == pytest.approx(stiffness, rel=1e-7)
    assert rod.rest_kappa[0] == pytest.approx(full_result.answer.pre_curvature_per_m)
    assert rod.rest_lengths.sum() == pytest.approx(LENGTH)


@pytest.mark.parametrize("form", FORMATS)
def test_every_file_says_what_was_measured_and_no_name_breaks_it(full_result, form):
    hostile = 'x\n*STEP --> """ import os'
    text = export(
        full_result.model_copy(update={"specimen": full_result.specimen.model_copy(update={"id": hostile})}), form
    )
    head = text.splitlines()[0:5]
    assert "EI = " in "".join(head) and "K0 = " in "".join(head)
    assert not [line for line in text.splitlines() if line.startswith(("*STEP", "import os"))]
    if form == "mujoco":
        assert ElementTree.fromstring(text).tag == "mujoco"


def test_formats_of_the_command_are_those_there_are():
    assert tuple(FORMATS) == NAMES


def test_the_command_writes_what_the_function_gives(full_result, failed_result, tmp_path):
    write_result(full_result, tmp_path)
    done = CliRunner().invoke(main, ["export", str(tmp_path), "--format", "abaqus", "--range", "3", "7"])
    assert (done.exit_code, done.stdout) == (0, export(full_result, "abaqus", bounds=(3.0, 7.0)))
    done = CliRunner().invoke(main, ["export", str(tmp_path), "-o", str(tmp_path / "beam.txt")])
    assert done.exit_code == 0 and (tmp_path / "beam.txt").read_text() == export(full_result, "table")
    write_result(failed_result, tmp_path)
    done = CliRunner().invoke(main, ["export", str(tmp_path)])
    assert done.exit_code == 3 and "cable-13 is not usable: force.csv: the log is empty" in done.stderr


def test_a_range_is_heeded_and_refused_where_nothing_was_measured(full_result):
    part = equivalent(full_result.answer.curve, (3.0, 7.0)).stiffness
    assert keywords(export(full_result, "abaqus", bounds=(3.0, 7.0)))[-1][2][0][0] == pytest.approx(part, rel=1e-8)
    with pytest.raises(ValueError, match=r"was bent from .* only"):
        export(full_result, "table", bounds=(20.0, 30.0))


def test_what_is_not_usable_is_not_exported(full_result, failed_result):
    fault = FindingPart(code="size/force", level="error", message="the forces are in mN")
    for result in (full_result.model_copy(update={"findings": [fault]}), failed_result):
        with pytest.raises(ValueError, match="not usable"):
            export(result, "table")
    with pytest.raises(ValueError, match="no format is called 'ansys'"):
        export(full_result, "ansys")


def test_constants_stand_once_and_the_cause_with_its_amount(diagnosed):
    result = diagnosed("named")
    frame = simulation_frame(result)
    assert frame.quantity.is_unique
    (cause,) = result.diagnosis.causes
    row = frame.set_index("quantity").loc[cause.name]
    assert (row["value"], row["std"]) == (cause.estimate, cause.std) and "without it" in row.note
    # the nearest cause of a misfit that none explains was named by nobody
    left = result.diagnosis.model_copy(update={"verdict": "unexplained"})
    assert cause.name not in simulation_frame(result.model_copy(update={"diagnosis": left})).quantity.to_numpy()
