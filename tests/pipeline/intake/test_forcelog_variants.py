"""One log in every way people and machines write it: the same steps come out."""

import re

import numpy as np
import pytest

from pipeline.errors import InputError
from pipeline.intake.forcelog import read_force_log
from pipeline.intake.specimenfile import LogSpec
from pipeline.settings.intake import IntakeSettings

SETTINGS = IntakeSettings()
PLAIN = """\
step,branch,time_s,displacement_mm,force_N,image
0,mounted,1.0,0.0,-0.002,
0,mounted,5.0,0.0,0.003,a_0.png
1,loading,61.0,4.5,2.301,
1,loading,65.0,4.5,2.304,a_1.png
2,unloading,121.0,2.25,1102.903,
2,unloading,125.0,2.25,1102.899,a_2.png
"""
GERMAN = (
    PLAIN.replace(",", ";")
    .replace(".png", "#png")
    .replace(".", ",")
    .replace("#", ".")
    .replace(
        "step;branch;time_s;displacement_mm;force_N;image",
        "Schritt;Richtung;Zeit [s];Weg [mm];Prüfkraft [N];Bild",
    )
    .replace("mounted", "montiert")
    .replace("unloading", "Entlastung")
    .replace("loading", "Belastung")
)
METADATA = "Prüfprotokoll\n\nPrüfer;Müller\nKraftaufnehmer;500 N\nDatum;21.11.2026\n\n"
VARIANTS = {
    "contract": PLAIN,
    "semicolons": PLAIN.replace(",", ";"),
    "tabs": PLAIN.replace(",", "\t"),
    "german": GERMAN,
    "german cp1252": GERMAN.encode("cp1252"),
    "utf-8 with mark": b"\xef\xbb\xbf" + GERMAN.encode(),
    "utf-16 with mark": GERMAN.encode("utf-16"),
    "utf-16 big endian": b"\xfe\xff" + GERMAN.encode("utf-16-be"),
    "utf-16 without mark": GERMAN.encode("utf-16-le"),
    "windows lines": PLAIN.replace("\n", "\r\n"),
    "old mac lines": PLAIN.replace("\n", "\r"),
    "blank rows": PLAIN.replace("\n1,", "\n\n,,,,,\n1,", 1) + "\n\n;;;\n,,,,,\n",
    "metadata": METADATA + GERMAN,
    "metadata cp1252": (METADATA + GERMAN).encode("cp1252"),
    "unit row": PLAIN.replace(
        "step,branch,time_s,displacement_mm,force_N,image",
        "Schritt,Richtung,Zeit,Weg,Kraft,Bild\n,,s,mm,[N],",
    ),
    "slash units": PLAIN.replace("time_s,displacement_mm,force_N", "t / s,Weg / mm,F / N"),
    "units in words": PLAIN.replace("time_s,displacement_mm,force_N", "Zeit in s,Weg in mm,Kraft in N"),
    "capitals": PLAIN.replace(
        "step,branch,time_s,displacement_mm,force_N", "STEP,Branch,TIME (S),Displacement (MM),FORCE (N)"
    ),
    "quoted": PLAIN.replace("2.301", '"2.301"').replace("a_1.png", '"a_1.png"'),
    "quoted decimal commas": '"' + GERMAN.replace(";", '","').replace("\n", '"\n"')[:-1],
    "thousands": GERMAN.replace("1102,9", "1.102,9").replace("1102,8", "1.102,8"),
    "english thousands": PLAIN.replace(",", ";").replace("1102.9", "1,102.9").replace("1102.8", "1,102.8"),
    "blanks as thousands": GERMAN.replace("1102,", "1\u00a0102,"),
    "typographic minus": PLAIN.replace("-0.002", "−0.002"),
    "exponents": PLAIN.replace("2.301", "2.301e+00").replace("-0.002", "-2.0E-03"),
    "carried down": PLAIN.replace("0,mounted,5.0,0.0", ",,5.0,").replace("1,loading,65.0", ",,65.0"),
    "other columns": "\n".join(
        f"{row},{extra}" for row, extra in zip(PLAIN.splitlines(), ["Temperature [C]", *"abcdef"], strict=True)
    ),
    "step texts": PLAIN.replace("\n0,", "\nStufe 0,").replace("\n1,", "\nStufe 1,").replace("\n2,", "\nStufe 2,"),
    "header again before every hold": PLAIN.replace("\n1,l", "\n" + PLAIN.splitlines()[0] + "\n1,l", 1),
    "symbols behind the names": PLAIN.replace("time_s,displacement_mm,force_N", "Zeit t [s],Weg s [mm],Kraft Fx [N]"),
    "symbols alone": PLAIN.replace("time_s,displacement_mm,force_N", "t [s],s [mm],F [N]"),
    "temperature": PLAIN.replace("time_s,", "T [°C],t / s,").replace("d,", "d,23.5,").replace("g,", "g,23.5,"),
    "asked for and measured": PLAIN.replace("time_s,displacement_mm", "Weg Soll [mm],time_s,Weg Ist [mm]")
    .replace("d,", "d,4.0,")
    .replace("g,", "g,4.0,"),
    "spelled out": PLAIN.replace("time_s,displacement_mm,force_N", "Zeit [Sekunden],Weg [Millimeter],Kraft (newton)"),
    "filled up with zeros": PLAIN.encode() + bytes(600),
    "end of file as in DOS": PLAIN + "\x1a",
    "Unicode text of Excel": b"\xff\xfe" + GERMAN.replace(";", "\t").encode("utf-16-le"),
    "surplus separators": PLAIN.replace("\n", ",,\n"),
    "units in the cells": re.sub(r"(\d),(a_|\n)", r"\1 N,\2", PLAIN.replace("force_N", "Kraft")),
    "units in the cells and above": re.sub(r"(\d),(a_|\n)", r"\1N,\2", PLAIN),
    "minus behind": PLAIN.replace("-0.002", "0.002-"),
    "one component": PLAIN.replace("force_N", "Fx [N]"),
}


def read(content, tmp_path, **spec):
    path = tmp_path / "force.csv"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return read_force_log(path, LogSpec(**spec), SETTINGS)


@pytest.mark.parametrize("name", VARIANTS)
def test_same_steps_from_every_variant(name, tmp_path):
    log = read(VARIANTS[name], tmp_path)
    assert [step.step for step in log.steps] == [0, 1, 2]
    assert [step.branch for step in log.steps] == ["mounted", "loading", "unloading"]
    assert [step.image for step in log.steps] == ["a_0.png", "a_1.png", "a_2.png"]
    np.testing.assert_allclose([step.displacement_m for step in log.steps], [0.0, 4.5e-3, 2.25e-3], rtol=1e-12)
    samples = [-0.002, 0.003, 2.301, 2.304, 1102.903, 1102.899]
    np.testing.assert_allclose(np.concatenate([step.forces_N for step in log.steps]), samples, rtol=1e-12)
    times = [1.0, 5.0, 61.0, 65.0, 121.0, 125.0]
    np.testing.assert_allclose(np.concatenate([step.times_s for step in log.steps]), times, rtol=1e-12)
    assert [step.photo_time_s for step in log.steps] == [5.0, 65.0, 125.0]


@pytest.mark.parametrize(
    ("header", "factor"),
    [
        ("Kraft [mN]", 1e-3), ("Kraft [kN]", 1e3), ("F / mN", 1e-3), ("force_mN", 1e-3), ("Kraft (µN)", 1e-6),
        ("Kraft [μN]", 1e-6), ("FORCE (KN)", 1e3), ("Last [kgf]", 9.80665), ("Kraft daN", 10.0), ("Kraft", 1.0),
    ],
)  # fmt: skip
def test_unit_of_the_force(header, factor, tmp_path):
    log = read(PLAIN.replace("force_N", header), tmp_path)
    np.testing.assert_allclose(log.steps[1].forces_N, np.array([2.301, 2.304]) * factor, rtol=1e-12)
    assert ("log/unit-assumed" in [finding.code for finding in log.findings]) == (header == "Kraft")


def test_units_of_displacement_and_time(tmp_path):
    log = read(PLAIN.replace("displacement_mm", "Weg [µm]").replace("time_s", "Zeit [min]"), tmp_path)
    assert log.steps[1].displacement_m == pytest.approx(4.5e-6)
    assert log.steps[1].photo_time_s == pytest.approx(65.0 * 60.0)


def test_a_unit_in_every_cell_is_that_of_the_column(tmp_path):
    text = re.sub(r"(\d),(a_|\n)", r"\1 mN,\2", PLAIN.replace("force_N", "Kraft"))
    log = read(text, tmp_path)
    np.testing.assert_allclose(log.steps[1].forces_N, [2.301e-3, 2.304e-3], rtol=1e-12)
    assert "log/unit-assumed" not in [finding.code for finding in log.findings]


def test_what_the_user_says_wins(tmp_path):
    odd = PLAIN.replace("force_N", "channel 3").replace("displacement_mm", "Traverse")
    log = read(odd, tmp_path, columns={"force": "Channel 3", "displacement": "traverse"}, units={"force": "mN"})
    assert log.steps[1].forces_N[0] == pytest.approx(2.301e-3)
    log = read("Schritt;Weg;Kraft\n1;1,500;2,301\n2;4,250;2,902\n", tmp_path, decimal=",")
    assert log.steps[1].displacement_m == pytest.approx(4.25e-3)
    log = read("Schritt;Weg;Kraft\n1;1,500;2,301\n2;4,250;2,902\n", tmp_path, decimal=".", units={"displacement": "µm"})
    assert log.steps[1].displacement_m == pytest.approx(4250e-6)


AMBIGUOUS = "Schritt;Zeit [s];Weg [mm];Kraft [mN];Temp [C]\n1.5;{};1,500;2,301;{}\n2.5;{};4,250;2,902;{}\n"


@pytest.mark.parametrize(
    ("cells", "factor"),
    [
        (("12,5", "", "72,5", ""), 1.0),  # the time is decisive
        (("1,000", "", "61,0000", ""), 1.0),
        (("0,125", "", "1,125", ""), 1.0),
        (("12.5", "", "72.5", ""), 1e3),
        (("1,234", "23,5", "1,334", "23,5"), 1.0),  # or any other column
        (("12:00:00,5", "", "12:01:00,5", ""), 1.0),
        (("21.11.2026 12:00:00,5", "", "21.11.2026 12:01:00,5", ""), 1.0),
    ],
)
def test_any_decisive_column_tells_the_decimal_sign_of_the_file(cells, factor, tmp_path):
    log = read(AMBIGUOUS.format(*cells), tmp_path)
    assert log.steps[1].displacement_m == pytest.approx(4.25e-3 * factor)
    assert log.steps[1].forces_N[0] == pytest.approx(2.902e-3 * factor)


@pytest.mark.parametrize(
    "cells",
    [
        ("1", "", "2", ""),  # the step's label 1.5 is no number
        ("12,5", "23.5", "72,5", "23.5"),  # two columns that contradict each other
        ("12:00:00.5", "", "12:01:00.5", ""),  # a clock with a point may stand in any file
    ],
)
def test_what_no_column_decides_is_refused(cells, tmp_path):
    with pytest.raises(InputError) as refused:
        read(AMBIGUOUS.format(*cells), tmp_path)
    assert refused.value.code == "log/ambiguous-decimal"


def test_no_cable_is_pushed_farther_than_it_is_long(tmp_path):
    # 1,500 to 4,250 mm lie 2.75 mm or 2.75 m apart, and the cable has a quarter of a metre
    path = tmp_path / "force.csv"
    path.write_text(AMBIGUOUS.format("1", "", "2", ""), encoding="utf-8")
    log = read_force_log(path, LogSpec(), SETTINGS, 0.25)
    assert log.steps[1].displacement_m == pytest.approx(4.25e-3)
    assert log.steps[1].forces_N[0] == pytest.approx(2.902e-3)
    # 1500 and 4250 um are travels of such a cable, so nothing decides
    path.write_text(AMBIGUOUS.format("1", "", "2", "").replace("[mm]", "[µm]"), encoding="utf-8")
    with pytest.raises(InputError) as refused:
        read_force_log(path, LogSpec(), SETTINGS, 0.25)
    assert refused.value.code == "log/ambiguous-decimal"


def test_a_log_without_header_by_column_numbers(tmp_path):
    rows = "\n".join(PLAIN.splitlines()[1:])
    columns = {"step": 1, "branch": 2, "time": 3, "displacement": 4, "force": 5, "image": 6}
    log = read("Versuch 12\n" + rows, tmp_path, columns=columns)
    assert [step.image for step in log.steps] == ["a_0.png", "a_1.png", "a_2.png"]
    assert log.steps[0].forces_N[0] == pytest.approx(-0.002)


def test_clock_times_and_epochs_count_from_the_first_row(tmp_path):
    times = ["1.0", "5.0", "61.0", "65.0", "121.0", "125.0"]
    clock = ["12:00:01", "12:00:05", "12:01:01", "12:01:05", "12:02:01", "12:02:05"]
    dated = [f"2026-11-21 {time}" for time in clock]
    german = [f"21.11.2026 {time}" for time in clock]
    short = [f"21.11.26 {time}" for time in clock]
    slashes = [f"2026/11/21 {time}" for time in clock]
    epoch = [f"{1.8e9 + float(time):.1f}" for time in times]
    midnight = ["23:58:01", "23:58:05", "23:59:01", "23:59:05", "00:00:01", "00:00:05"]
    winter = [  # summer time ends between the first and the second step
        *("2026-10-25T02:59:01+02:00", "2026-10-25T02:59:05+02:00", "2026-10-25T02:00:01+01:00"),
        *("2026-10-25T02:00:05+01:00", "2026-10-25T01:01:01Z", "2026-10-25T01:01:05Z"),
    ]
    for written in (clock, dated, german, short, slashes, epoch, midnight, winter):
        text = PLAIN
        for old, new in zip(times, written, strict=True):
            text = text.replace(f",{old},", f",{new},", 1)
        log = read(text, tmp_path)
        assert [step.photo_time_s for step in log.steps] == [4.0, 64.0, 124.0], written
        assert "log/clock-time" in [finding.code for finding in log.findings]


def test_missing_forces_are_left_out_and_told(tmp_path):
    for missing in ("", "NaN", "n/a", "-", "inf", "#WERT!", "#DIV/0!"):
        log = read(PLAIN.replace("2.301", missing), tmp_path)
        assert len(log.steps[1].forces_N) == 1
        assert [f.level for f in log.findings if f.code == "log/missing-force"] == ["warning"]


def test_photo_named_in_a_row_without_force_is_kept(tmp_path):
    log = read(PLAIN.replace("2.304,a_1.png", ",a_1.png"), tmp_path)
    assert log.steps[1].image == "a_1.png"


def test_rows_of_a_summary_are_no_samples(tmp_path):
    plain = read(PLAIN, tmp_path)
    log = read(PLAIN + "mean,,,,3.1,\nEnd of the test,,,,,\n", tmp_path)
    assert [step.force_N for step in log.steps] == [step.force_N for step in plain.steps]
    assert log.steps[2].photo_time_s == plain.steps[2].photo_time_s
    assert [finding.code for finding in log.findings] == ["log/summary"]


@pytest.mark.parametrize(
    "below",
    [
        "Mittelwert,,,2.2,1.5,\nMax,,,4.5,1102.9,\n",
        "Summe,,377.0,13.5,2210.4,\n",
        "\n,,Standardabw.,0.1,0.2,\nStd,,,1,2,\n",
    ],
)
def test_a_summary_with_numbers_is_none_either(below, tmp_path):
    plain, log = read(PLAIN, tmp_path), read(PLAIN + below, tmp_path)
    assert [step.force_N for step in log.steps] == [step.force_N for step in plain.steps]
    assert log.steps[2].photo_time_s == plain.steps[2].photo_time_s
    assert [finding.code for finding in log.findings] == ["log/summary"]


@pytest.mark.parametrize("towards", [1.0, -1.0])
def test_a_machine_that_counts_its_own_way_begins_where_there_is_no_force(towards, tmp_path):
    """Its position at the mounted cable is none of the cable's: 312.45 mm stood for a displacement."""
    rows = [(0.0, 0.001), (4.0, 2.3), (8.0, 2.9), (4.0, 2.1)]
    text = "Weg;Kraft\n" + "".join(
        f"{312.45 + towards * d:.2f};{f + e:.3f}\n" for d, f in rows for e in (0.0, 0.002, -0.001)
    )
    log = read(text.replace(".", ","), tmp_path)
    np.testing.assert_allclose([step.displacement_m for step in log.steps], [0.0, 4e-3, 8e-3, 4e-3], atol=1e-9)
    assert [step.branch for step in log.steps] == ["mounted", "loading", "loading", "unloading"]
    assert "log/displacement-zero" in [finding.code for finding in log.findings]


@pytest.mark.parametrize(
    ("content", "code", "told"),
    [
        (b"PK\x03\x04" + bytes(200), "log/encoding", "is an Excel workbook"),
        (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(200), "log/encoding", "is an Excel workbook"),
        (b"%PDF-1.7\n1 0 obj", "log/encoding", "is a PDF document"),
        ("t/s   Weg/mm   Kraft/N\n0.5   1.5   2.5\n", "log/no-header", "semicolons, commas or tabs"),
        ("Weg [mm]|Kraft [N]\n1.5|2.5\n", "log/no-header", "semicolons, commas or tabs"),
    ],
)
def test_what_is_no_table_is_called_by_its_name(content, code, told, tmp_path):
    with pytest.raises(InputError) as refused:
        read(content, tmp_path)
    assert refused.value.code == code and told in refused.value.sentence


def test_displacement_in_the_first_row_of_each_hold_is_no_summary(tmp_path):
    text = PLAIN
    for last in ("5.0,0.0", "65.0,4.5", "125.0,2.25"):
        text = text.replace(last, last.partition(",")[0] + ",")
    assert [len(step.forces_N) for step in read(text, tmp_path).steps] == [2, 2, 2]


def test_times_in_no_known_notation_cost_the_times_only(tmp_path):
    text = PLAIN
    for time in ("1.0", "5.0", "61.0", "65.0", "121.0", "125.0"):
        text = text.replace(f",{time},", f",11/21/2026 8:00:{float(time) / 10:02.0f} AM,", 1)
    log = read(text, tmp_path)
    assert all(step.photo_time_s is None for step in log.steps)
    assert [finding.code for finding in log.findings] == ["log/time-format"]
    with pytest.raises(InputError):  # one that cannot be read among others that can is a mistake
        read(PLAIN.replace(",65.0,", ",65 s,"), tmp_path)


def test_time_that_runs_backwards_is_not_used(tmp_path):
    log = read(PLAIN.replace("65.0", "5.0"), tmp_path)
    assert log.steps[1].times_s.size == 0
    assert log.steps[1].photo_time_s is None
    assert "log/time-order" in [finding.code for finding in log.findings]


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("", "log/empty"),
        ("\n \n;;;\n", "log/empty"),
        ("step,displacement_mm,force_N\n1,4.0,abc\n", "log/not-a-number"),
        ("step,displacement_mm,force_N\n1,4.0,1e12\n", "log/not-a-number"),
        ("step,displacement_mm,force_N\n1,1.2.3,4\n", "log/not-a-number"),
        ("step;displacement_mm;force_N\n1;0,5;1.5\n2;1,5;2.5\n", "log/not-a-number"),
        ("step,displacement_mm,force_mm\n1,4.0,1\n", "log/unit"),
        ("Kraft;Kraft [N];Weg\n1;1;1\n", "log/ambiguous-column"),
        ("Fx;Fz;Weg\n1;1;1\n", "log/ambiguous-column"),
        ("Kraft [N];Weg\n1 mN;1\n2 mN;2\n", "log/unit"),
        ("Kraft;Weg\n1 kip;1\n2 kip;2\n", "log/unit"),
        ("Kraft;Weg\n1 mN;1\n2 N;2\n", "log/not-a-number"),
    ],
)
def test_refusals(text, code, tmp_path):
    with pytest.raises(InputError) as refused:
        read(text, tmp_path)
    assert refused.value.code == code
    assert str(tmp_path / "force.csv") in refused.value.sentence
