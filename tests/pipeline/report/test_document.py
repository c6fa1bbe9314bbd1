"""report.html: one file without network, complete for every kind of result, and nothing of a user is ever markup."""

import base64
import re
from html.parser import HTMLParser

import pytest

from pipeline.messages import Message, word
from pipeline.report.answer import first_screen
from pipeline.report.canvas import page_colours
from pipeline.report.document import report_html, write_report
from pipeline.report.page import unbroken
from pipeline.report.pdf import pdf_bytes
from pipeline.report.provenance import fit_rows, nuisance_rows
from pipeline.report.words import Words
from pipeline.result import FindingPart, PhotoPart
from pipeline.settings import ReportSettings

VOID = {"meta", "link", "img", "input", "br", "hr"}
LARGEST_BYTES = 3_000_000


class Page(HTMLParser):
    """Elements, texts, identifiers of a page; complains about tags that do not match."""

    def __init__(self, text):
        super().__init__()
        self.open, self.tags, self.attributes, self.texts = [], [], [], []
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes.append(dict(attrs))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.tags.append(tag)
        self.attributes.append(dict(attrs))

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        if "script" not in self.open and "style" not in self.open:
            self.texts.append(data)

    @property
    def text(self):
        return re.sub(r"\s+", " ", " ".join(self.texts))


def headline(text):
    """The first sentence, whose quantities no line break takes apart."""
    return re.search(r"<h1>(.*?)</h1>", text, re.DOTALL)[1].replace("\N{NO-BREAK SPACE}", " ")


@pytest.fixture(scope="module")
def page(full_result):
    return report_html(full_result)


@pytest.fixture(scope="module")
def brief(full_result):
    """The result with one photo: each is a figure of its own, and they all look alike."""
    return full_result.model_copy(update={"photos": full_result.photos[:1]})


@pytest.fixture(scope="module")
def named_page(diagnosed):
    return report_html(diagnosed("named"))


def test_the_answer_comes_first_with_its_uncertainty(page):
    heading = headline(page)
    assert "falls from 20.00 ± 0.13 mN m² at κ = 2.00 1/m to 8.54 ± 0.13 mN m²" in heading
    assert "K0 = 2.004 ± 0.013 1/m" in heading
    assert page.index("<h1>") < page.index('id="characteristic"') < page.index('id="photos"') < page.index('id="data"')


def test_pre_curvature_stands_there_three_ways(page):
    assert all(text in Page(page).text for text in ("2.001 ± 0.006 1/m", "1.99 ± 0.04 1/m", "2.004 ± 0.013 1/m"))


def test_everything_is_inside_the_file(page):
    links = [a[k] for a in Page(page).attributes for k in ("src", "href") if k in a]
    assert links
    assert all(link.startswith(("#", "data:")) for link in links)
    assert not re.search(r"@import|url\((?!#)", page)


def test_identifiers_are_unique_and_references_have_a_target(page):
    parsed = Page(page)
    names = [a["id"] for a in parsed.attributes if "id" in a]
    assert len(names) == len(set(names))
    wanted = {a["href"][1:] for a in parsed.attributes if a.get("href", "").startswith("#")}
    wanted |= set(re.findall(r"url\(#([^)]+)\)", page))
    assert wanted <= set(names)


def test_every_figure_and_photo_has_a_text_alternative(page, full_result):
    parsed = Page(page)
    plots = [a for t, a in zip(parsed.tags, parsed.attributes, strict=True) if t == "svg" and a.get("class") == "plot"]
    assert len(plots) == 1 + 5 + len(full_result.photos)
    assert all(a["role"] == "img" and a["aria-labelledby"] for a in plots)
    pictures = [a for t, a in zip(parsed.tags, parsed.attributes, strict=True) if t == "img"]
    assert len(pictures) == 2 * len(full_result.photos)
    assert all(a["alt"] for a in pictures)


def test_axes_carry_units(page):
    for label in ("curvature κ [1/m]", "bending stiffness f_EI = dm/dκ [mN m²]", "force P [N]", "arc length s [mm]"):
        assert label in page


def test_colours_follow_the_page(page):
    plots = "".join(re.findall(r'<svg xmlns="http://www.w3.org/2000/svg".*?</svg>', page, re.DOTALL))
    assert "var(--inverse)" in plots
    assert not [light for light, _ in page_colours().values() if light in plots]


def test_centerline_lies_on_the_photo(page, full_result):
    photo = full_result.photos[3]
    first = re.findall(r'class="seen" d="M([\d.]+) ([\d.]+)L', page)[3]
    index = photo.seen.index(True)
    expected = ((photo.u_px[index] + 0.5) / 2.4, (photo.v_px[index] + 0.5) / 2.4)
    assert [float(v) for v in first] == pytest.approx(expected, abs=0.06)  # half of the last digit written


def test_what_all_photos_share_stands_under_their_table(page, full_result, brief):
    text = Page(page).text
    assert "the error of the scale, ± 0.04 %, is common to all photos" in text
    assert "too far apart, by ± 0.41 %" in text
    pointed_at = full_result.scale.model_copy(update={"axis_parallax_std": 0.0})
    assert "too far apart" not in Page(report_html(brief.model_copy(update={"scale": pointed_at}))).text


def test_provenance_is_shown(page, full_result):
    text = Page(page).text
    assert full_result.provenance["command"] in text
    assert "ab" * 32 in text
    assert "libraries" in text
    assert "numpy 2.4.6, scipy 1.17.1" in text
    assert "measured (UTC)" in text


@pytest.mark.parametrize("verdict", ["adequate", "named", "class", "two_causes", "unexplained", "underpowered"])
def test_every_verdict_has_its_sections(diagnosed, verdict):
    page = report_html(diagnosed(verdict))
    text = Page(page).text
    assert f"The verdict is {verdict}: hysteresis between the wires bends <the> answer." in text
    assert 'id="ranking"' in page
    assert 'id="cosines"' in page
    assert "dead weights on the load cell" in text
    found = verdict in ("named", "class", "two_causes")
    assert ('id="map-before"' in page) == found
    assert page.count('id="residual-map"') == 1  # of the model that answers
    assert ('id="aside-toggle"' in page) == found and page.count('class="set-aside"') == (6 if found else 0)
    assert ("removes 94 %" in text) == found
    assert ("A hump at mid-span" in text) == (verdict == "unexplained")
    assert ('id="leftover"' in page) == (verdict == "unexplained")
    assert ('id="force-rest"' in page) == found
    assert ("Turn the cable end for end" in text) == (verdict != "adequate")
    assert ("cannot be told apart here from bearing friction" in text) == (verdict == "class")


def test_what_is_left_in_the_forces_alone_has_no_pattern_along_the_cable(diagnosed):
    result = diagnosed("unexplained")
    left = result.diagnosis.leftover
    left = left.model_copy(update={"shape_m": [0.0] * len(left.s_m)})
    page = report_html(result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"leftover": left})}))
    assert 'id="leftover"' not in page and "A hump at mid-span" in Page(page).text


@pytest.mark.parametrize(("verdict", "without"), [("named", True), ("adequate", False)])
def test_the_fit_says_which_model_it_is_of(diagnosed, verdict, without):
    assert ("without the cause that was found" in dict(fit_rows(diagnosed(verdict), Words()))["outcome"]) == without


@pytest.mark.parametrize(("probability", "told"), [(0.1, " 10 %."), (1e-6, " < 0,1 %."), (0.99, "")])
def test_leftover_that_noise_makes_has_no_place(diagnosed, probability, told):
    result = diagnosed("named").model_copy(update={"photos": []})
    left = diagnosed("unexplained").diagnosis.leftover.model_copy(update={"probability": probability})
    page = report_html(
        result.model_copy(update={"diagnosis": result.diagnosis.model_copy(update={"leftover": left})}),
        ReportSettings(language="de"),
    )
    assert ("nicht mehr als Rauschen" in Page(page).text) == bool(told) and told in Page(page).text
    assert ('id="leftover"' in page) != bool(told)


def test_no_line_break_takes_a_quantity_apart(page):
    told = unbroken("hysteresis (4.59 ± 0.02 mN m, 2 N m²) removes 94 % on steps in N mm (p < 0.01)")
    assert (
        told.replace("\u00a0", "_") == "hysteresis (4.59_±_0.02_mN_m, 2_N_m²) removes 94_% on steps in N mm (p_<_0.01)"
    )
    assert re.findall(r"\d %|\bp [<=]", " ".join(Page(page).texts)) == []


def test_what_was_fitted_besides_has_names_and_units(full_result):
    fitted = {
        "length": (-4e-5, 9e-5),
        "scale": (0.0013, 0.0005),
        "left_along": (4.2e-6, 2.7e-6),
        "tilt_along": (0.01, 0.02),
    }
    inverse = full_result.inverse.model_copy(update={"nuisance": fitted})
    rows = nuisance_rows(full_result.model_copy(update={"inverse": inverse}), Words("de"))
    assert rows == [
        ("Länge", "−40 ± 90\u00a0µm"),
        ("Maßstab", "0,13 ± 0,05\u00a0%"),
        ("linke Achse, längs der Sehne", "4,2 ± 2,7\u00a0µm"),
        ("Neigung der Kamera, längs der Sehne", "0,010 ± 0,020\u00a01/m"),
    ]


def test_answer_is_that_of_the_extended_model(diagnosed, named_page):
    curve = diagnosed("named").diagnosis.extended
    heading = headline(named_page)
    assert f"{1e3 * curve.tangent_Nm2[0]:.2f} ± {1e3 * curve.tangent_std_Nm2[0]:.2f}" in heading


def test_nothing_of_a_user_is_markup(partial_result):
    page = report_html(partial_result)
    parsed = Page(page)
    assert page.count("<script") == 2
    assert not [a for a in parsed.attributes if "onerror" in a]
    assert "<script>alert(1)</script>" in parsed.text
    assert "<b>step_01</b> was rejected." in parsed.text
    assert "the file does not exist" in parsed.text


def test_failed_specimen_says_why(failed_result):
    text = Page(report_html(failed_result)).text
    assert "Specimen cable-13 was not measured: force.csv: the log is empty; export it again." in text
    assert "Mend what is listed below and run the same command again" in text


def test_specimen_whose_photos_were_all_refused_says_so_first(full_result):
    refused = [
        PhotoPart(image=photo.image, step=photo.step, status="rejected", **PhotoPart.told(Message("photo/empty")))
        for photo in full_result.photos[:2]
    ]
    steps = [step.model_copy(update={"force_fit_N": None}) for step in full_result.steps]
    nothing = dict.fromkeys(("inverse", "balance", "agreement")) | {"status": "failed"}
    nothing |= {"photos": refused, "steps": steps}
    page = report_html(full_result.model_copy(update=nothing), ReportSettings(language="de"))
    heading = headline(page)
    assert heading == (
        f"Probe cable-07 wurde nicht vermessen: Keines ihrer 2 Fotos war verwendbar. Das erste: {refused[0].image}: "
        "Die Datei ist leer."
    )
    assert "Sie danach neu aufnehmen" in page
    assert "Dieses Foto wurde nicht verwendet: Die Datei ist leer" in page and "abgelehnt: Die Datei ist leer" in page
    assert "simuliert</text>" not in page


@pytest.mark.parametrize(("size", "said"), [(0.7, "errors make 70 % likely"), (3.0, "errors make 299 % likely")])
def test_ways_whose_bands_say_nothing_are_not_said_to_agree(full_result, size, said):
    curve = full_result.inverse.curve
    std = [size * value for value in curve.tangent_Nm2]
    inverse = full_result.inverse.model_copy(update={"curve": curve.model_copy(update={"tangent_std_Nm2": std})})
    wide = full_result.model_copy(update={"inverse": inverse, "diagnosis": None})
    assert wide.agreement.compatible
    told = [first_screen(one, Words()).agreement for one in (wide, full_result)]
    assert told[0].startswith("Whether the two ways agree cannot be told: ") and said in told[0]
    assert "The two ways agree: " in told[1] and "p = " not in told[1]


def test_disagreement_and_a_missing_diagnosis_are_said(full_result, brief):
    agreement = full_result.agreement.model_copy(update={"compatible": False, "rms_relative": 0.2, "p_value": 1e-4})
    text = Page(report_html(brief.model_copy(update={"agreement": agreement, "diagnosis": None}))).text
    assert "The two ways disagree: they differ by 20 % rms" in text
    assert "Whether the model is adequate was not examined." in text


def test_german_page_has_german_words_and_numbers(brief):
    page = report_html(brief, ReportSettings(language="de"))
    text = Page(page).text
    assert '<html lang="de">' in page
    assert "Die Biegesteifigkeit f_EI von cable-07 fällt von 20,00 ± 0,13" in text.replace("\N{NO-BREAK SPACE}", " ")
    assert "Krümmung κ [1/m]" in text
    assert not re.search(r"\d\.\d+ ± ", text)


def test_german_page_says_the_verdict_in_german(diagnosed):
    result = diagnosed("class")
    size = (0.0049, 0.0002, "N m")
    cause = Message("diagnosis.cause", names=[word("hysteresis")], size=size)
    told = Message("diagnosis.named", cause=cause, gain="", shift="").stored()
    finding = FindingPart.of("warning", Message("photo/empty"))
    strange = FindingPart(code="my/own", level="warning", message="The moon is full.")
    changed = {"diagnosis": result.diagnosis.model_copy(update=told), "findings": [finding, strange]}
    page = report_html(result.model_copy(update=changed), ReportSettings(language="de"))
    text = Page(page).text
    assert "Der Simulation fehlt: Hysterese (4,90 ± 0,20 mN m)." in text.replace("\N{NO-BREAK SPACE}", " ")
    assert "<span>Die Datei ist leer</span>" in page
    assert '<span lang="en">The moon is full.</span>' in page
    assert "Drähte reiben aneinander" in text
    assert "hier nicht zu trennen von Lagerreibung" in text


def test_unsupported_points_are_not_drawn(full_result, brief):
    curve = full_result.inverse.curve
    supported = [kappa < 6.0 for kappa in curve.kappa_per_m]
    inverse = full_result.inverse.model_copy(update={"curve": curve.model_copy(update={"supported": supported})})
    last = max(kappa for kappa in curve.kappa_per_m if kappa < 6.0)
    heading = headline(report_html(brief.model_copy(update={"inverse": inverse})))
    assert f"at κ = {last:.2f} 1/m" in heading


def test_where_f_is_known_no_better_than_to_itself_it_is_not_told(full_result, brief):
    curve = full_result.inverse.curve
    for wide, told in ((4.0, "1/m"), (float("inf"), "do not tell")):
        std = [2.0 * f if k < wide else 0.01 * f for k, f in zip(curve.kappa_per_m, curve.tangent_Nm2, strict=True)]
        changed = {"tangent_std_Nm2": std, "tangent_factor_Nm2": []}
        inverse = full_result.inverse.model_copy(update={"curve": curve.model_copy(update=changed)})
        heading = headline(report_html(brief.model_copy(update={"inverse": inverse})))
        first = min((k for k in curve.kappa_per_m if k >= wide), default=None)
        assert told in heading and (first is None or f"at κ = {first:.2f} 1/m" in heading)


def test_report_is_small_and_the_same_each_time(page, full_result, tmp_path):
    path = write_report(full_result, tmp_path / "a")
    assert path.stat().st_size < LARGEST_BYTES
    assert path.read_text(encoding="utf-8") == page
    assert [p.name for p in (tmp_path / "a").iterdir()] == ["report.html"]
    assert base64.b64decode(full_result.photos[0].preview.jpeg_base64)[:2] == b"\xff\xd8"


def test_branches_fitted_apart_are_drawn(full_result):
    branches = {"loading": full_result.inverse.curve, "unloading": full_result.balance.curve}
    inverse = full_result.inverse.model_copy(update={"branches": branches})
    few = full_result.model_copy(update={"inverse": inverse, "photos": []})
    assert 'id="branches"' in report_html(few)


def test_curve_without_covariance_gives_a_bound(full_result):
    curve = full_result.inverse.curve.model_copy(update={"tangent_factor_Nm2": []})
    inverse = full_result.inverse.model_copy(update={"curve": curve})
    text = Page(report_html(full_result.model_copy(update={"inverse": inverse, "photos": []}))).text
    assert "The error is an upper bound" in text


def test_answer_of_an_extended_model_speaks_of_its_own_pre_curvature(named_page):
    assert "K0 = 2.00000 ± 0.00005 1/m" in headline(named_page)  # where the moment of its own curve is zero
    assert "Both ways lack what the extended model adds: that they differ by" in named_page


def without(*names):
    empty = {"photos": [], "steps": [], "provenance": {}}
    return {name: empty.get(name) for name in names}


@pytest.mark.parametrize(
    "changes",
    [
        without("inverse"),
        without("balance"),
        without("inverse", "balance", "agreement"),
        without("photos"),
        without("steps", "scale", "provenance"),
    ],
    ids=lambda changes: "no " + ", ".join(changes),
)
def test_what_is_missing_is_left_out(diagnosed, changes):
    adequate = diagnosed("adequate")
    result = adequate.model_copy(update={"photos": adequate.photos[:1]} | changes)
    page = Page(report_html(result))
    names = [a["id"] for a in page.attributes if "id" in a]
    assert ("forces" in names) == bool(result.steps)
    assert ("characteristic" in names) == bool(result.inverse or result.balance)
    assert ("kappa-0" in names) == bool(result.photos)
    assert 2 <= len(re.findall(rb"/Type /Page\b", pdf_bytes(result))) <= 4


def test_photo_without_fit_preview_or_visible_cable_is_shown_as_far_as_it_goes(full_result):
    bare = {"kappa_fit_per_m": [], "shape_residual_m": [], "shape_residual_std_m": [], "preview": None}
    photos = [full_result.photos[0].model_copy(update=bare)]
    photos.append(full_result.photos[1].model_copy(update={"seen": [False] * 201}))
    page = report_html(full_result.model_copy(update={"photos": photos}))
    assert "No preview was kept of this photo." in page
    assert 'id="kappa-1"' in page
