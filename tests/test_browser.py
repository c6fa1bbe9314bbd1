"""Report and index in a real Chromium: what a reader sees, presses and types.

No network, no errors on the console, no sideways scrolling. What becomes of these tests on a machine without Chromium
is said in ``tests/conftest.py``.
"""

from __future__ import annotations

import base64
import re
import shutil
import zlib
from dataclasses import replace
from pathlib import Path
from urllib.parse import urlparse

import numpy as np
import pytest
from selenium import webdriver
from selenium.webdriver.chrome.options import Options
from selenium.webdriver.chrome.service import Service
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.common.by import By
from selenium.webdriver.common.keys import Keys
from selenium.webdriver.support.ui import Select, WebDriverWait

from pipeline.intake.photohints import read_hints
from pipeline.intake.tomltable import read_toml
from pipeline.messages import free_text
from pipeline.report.document import write_report
from pipeline.report.index import write_rows
from pipeline.result.row import index_row
from pipeline.settings import ReportSettings
from tests.pipeline.report.virtual_diagnosis import diagnosis_of
from tests.pipeline.report.virtual_index import write_index
from tests.pipeline.report.virtual_result import measured_result

pytestmark = pytest.mark.browser

# --force-prefers-reduced-motion: else a click may meet a page that still scrolls
FLAGS = """--headless --no-sandbox --disable-gpu --disable-quic --no-first-run --disable-background-networking
    --disable-component-update --disable-sync --force-prefers-reduced-motion"""
PHONE, DESK = 380, 1280
MANY = 5000


@pytest.fixture(scope="session")
def browser(tmp_path_factory):
    options = Options()
    options.binary_location = shutil.which("chromium")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL", "performance": "ALL"})
    for flag in (*FLAGS.split(), f"--user-data-dir={tmp_path_factory.mktemp('chromium')}"):
        options.add_argument(flag)
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    yield driver
    driver.quit()


def batch(result, count):
    """Repeat specimens whose stiffness rises with their number; every tenth failed."""
    whole = result.inverse.curve
    for number in range(count):
        curve = whole.model_copy(update={"tangent_Nm2": [(1 + number / count) * v for v in whole.tangent_Nm2]})
        specimen = result.specimen.model_copy(
            update={"id": f"cable-{number}", "description": {"type": f"HV {number % 3}"}}
        )
        failed = {"status": "failed", "inverse": None, "balance": None, "agreement": None, "diagnosis": None}
        measured = {"inverse": result.inverse.model_copy(update={"curve": curve}), "diagnosis": None}
        changes = failed if number % 10 == 9 else measured
        yield result.model_copy(update={"specimen": specimen, "photos": result.photos[3:4], **changes})


def many_rows(result):
    """Rows of 5,000 specimens, stiffness falling with their number; every hundredth has its forces in mN."""
    row = index_row(result)
    hostile = "<img src=x onerror=alert(1)></script>"
    for number in range(MANY):
        fault = {"usable": False, "fault": free_text(f"forces of {hostile} are in mN")} if number % 100 == 50 else {}
        low = (row.low[0], (2.0 - number / MANY) * row.low[1], row.low[2])
        yield replace(row, id=f"cable-{number}", type="HV", low=low, report=f"cable-{number}/report.html", **fault)


@pytest.fixture(scope="session")
def site(tmp_path_factory):
    """Address of a batch: reports in both languages, small indexes and one of 5,000 rows."""
    folder = tmp_path_factory.mktemp("site")
    result = measured_result()
    result = result.model_copy(update={"diagnosis": diagnosis_of("class", result.photos)})
    write_report(result, folder / "cable-0")
    write_report(result, folder / "de", ReportSettings(language="de"))
    for count, place in ((20, folder), (32, folder / "printed")):
        write_index(batch(result, count), place)
    write_rows(list(many_rows(result)), folder / "huge", ReportSettings())
    return folder.as_uri()


@pytest.fixture
def show(browser):
    """Open a page at a width; afterwards nothing may have been fetched from a network and nothing complained."""
    opened = []

    def go(address, width=DESK):
        for log in ("browser", "performance"):
            browser.get_log(log)
        metrics = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
        browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)
        browser.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "", "features": []})
        browser.execute_cdp_cmd("Emulation.setFocusEmulationEnabled", {"enabled": True})  # no window has it at first
        browser.get(address)
        # `get` of the address that is shown may return too early
        WebDriverWait(browser, 60).until(lambda d: d.execute_script("return document.readyState") == "complete")
        opened.append(address)
        return browser

    yield go
    assert opened
    assert browser.get_log("browser") == []
    messages = [entry["message"] for entry in browser.get_log("performance")]
    sent = [message for message in messages if "Network.requestWillBeSent" in message]
    assert sent
    assert not [message for message in sent if '"url":"http' in message or '"url":"ws' in message]


def one(driver, selector):
    return driver.find_element(By.CSS_SELECTOR, selector)


def shown(driver, selector):
    return [element for element in driver.find_elements(By.CSS_SELECTOR, selector) if element.is_displayed()]


@pytest.mark.parametrize("page", ["cable-0/report.html", "de/report.html", "index.html", "huge/index.html"])
@pytest.mark.parametrize("width", [PHONE, 768, DESK])
def test_no_sideways_scrolling(show, site, page, width):
    driver = show(f"{site}/{page}", width)
    assert driver.execute_script("return document.documentElement.scrollWidth") <= width


@pytest.mark.parametrize("width", [PHONE, DESK])
def test_name_verdict_and_reason_of_a_row_are_read_without_scrolling_sideways(show, site, width):
    driver = show(f"{site}/huge/index.html", width)
    row = one(driver, "tr.unusable")
    for selector in ("td:nth-child(2)", "td:nth-child(6)", ".why"):
        box = row.find_element(By.CSS_SELECTOR, selector).rect
        assert box["x"] >= 0 and box["width"] > 50 and box["x"] + box["width"] <= width, selector
    columns = [cell.rect["y"] for cell in row.find_elements(By.CSS_SELECTOR, ".num")]
    assert len(set(columns)) == 1


def test_answer_fills_the_first_screen(show, site):
    driver = show(f"{site}/cable-0/report.html")
    for selector in ("h1", "#characteristic", ".side .card:last-child"):
        box = one(driver, selector).rect
        assert box["y"] + box["height"] <= 900, selector


def test_photos_are_stepped_through_by_button_list_and_key(show, site):
    driver = show(f"{site}/cable-0/report.html")
    head = "article.photo:not([hidden]) h3"
    assert len(shown(driver, "article.photo")) == 1
    one(driver, "#photo-next").click()
    assert "step 1" in one(driver, head).text
    Select(one(driver, "#photo-choose")).select_by_index(5)
    assert "step 5" in one(driver, head).text
    one(driver, "#photo-next").send_keys(Keys.ARROW_RIGHT, Keys.ARROW_RIGHT)
    assert "step 0" in one(driver, head).text
    one(driver, "#photo-previous").click()
    assert "step 6" in one(driver, head).text


def test_centerline_is_toggled(show, site):
    driver = show(f"{site}/cable-0/report.html")
    line = "article.photo:not([hidden]) .picture svg"
    assert shown(driver, line)
    one(driver, "#photo-toggle").click()
    assert not shown(driver, line)
    one(driver, "#photo-next").send_keys("c")
    assert shown(driver, line)


def test_clicks_on_a_photo_become_lines_of_the_specimen_file(show, site, tmp_path):
    driver, photo = show(f"{site}/cable-0/report.html", PHONE), measured_result().photos[0]
    left, right = shown(driver, "article.photo:not([hidden]) circle:not(.mark)")
    places = [(right, 0, 0), (left, 30, -15), (left, 0, 0)]  # and so many px of the screen beside
    begun = {"ends_px": 1, "path_px": 1, "region_px": 1, "exclude_px": 2}
    clicks = {"use": 1, "ends_px": 2, "path_px": 3, "region_px": 2, "exclude_px": 3}
    for numbers in (begun, clicks):
        for key, count in numbers.items():
            Select(one(driver, "#mark")).select_by_value("")
            Select(one(driver, "#mark")).select_by_value(key)
            for place in places[:count]:
                ActionChains(driver).move_to_element_with_offset(*place).click().perform()
        assert one(driver, "#marked").is_displayed() == (numbers is clicks)  # what is half done is no line yet
    assert len(shown(driver, "circle.mark")) == sum(clicks.values())
    (tmp_path / "specimen.toml").write_text(one(driver, "#mark-lines").text)
    ((image, told),) = read_hints(read_toml(tmp_path / "specimen.toml", limit=10_000)).items()
    assert (image, told.use) == (photo.image, False)
    picture = one(driver, "article.photo:not([hidden]) .picture")
    pixel = photo.preview.reduction * photo.preview.width / picture.rect["width"]
    points = np.array([photo.right_px, np.add(photo.left_px, (30 * pixel, -15 * pixel)), photo.left_px])
    assert np.array(told.ends_px) == pytest.approx(points[:2], abs=pixel)
    assert np.array(told.path_px) == pytest.approx(points, abs=pixel)
    assert np.array(told.exclude_px) == pytest.approx(points[None], abs=pixel)
    assert told.region_px == pytest.approx([*points[:2].min(axis=0), *points[:2].max(axis=0)], abs=pixel)


def test_pointing_at_the_characteristic_tells_value_band_and_photos(show, site):
    driver = show(f"{site}/cable-0/report.html")
    ActionChains(driver).move_to_element(one(driver, "#characteristic")).perform()
    text = one(driver, "#readout").text
    assert all(part in text for part in ("κ = ", "extended model: ", " ± ", "(band ", "photos: "))
    assert len(shown(driver, "#point circle")) == 1


def test_characteristic_is_read_by_keyboard_alone(show, site):
    driver = show(f"{site}/cable-0/report.html")
    stage = one(driver, "#characteristic-stage")
    stage.send_keys(Keys.HOME)
    assert "κ = 2 1/m. extended model: 20.00 ± 0.11 mN m² (band 19.78 … 20.22)" in one(driver, "#readout").text
    stage.send_keys(Keys.ARROW_RIGHT)
    assert "κ = 2.13 1/m" in one(driver, "#readout").text
    stage.send_keys(Keys.ESCAPE)
    assert "arrow keys" in one(driver, "#readout").text


def test_equivalent_stiffness_of_a_chosen_range(show, site):
    driver = show(f"{site}/de/report.html")
    assert not one(driver, "#range-result").text  # the static line above it says the same
    field = one(driver, "#range-from")
    field.clear()
    field.send_keys("5")
    after = one(driver, "#range-result").text
    assert "mN m²" in after and "κ 5 … 8,7 1/m" in after


def test_curves_without_the_cause_are_switched_on(show, site):
    driver = show(f"{site}/cable-0/report.html")
    assert not shown(driver, "#characteristic .set-aside")
    one(driver, "#characteristic-stage").send_keys(Keys.END)
    assert "simulation fitted" not in one(driver, "#readout").text
    one(driver, "#aside-toggle").click()
    assert shown(driver, "#characteristic .set-aside")
    one(driver, "#characteristic-stage").send_keys(Keys.HOME)
    assert "simulation fitted" in one(driver, "#readout").text


def test_terms_explain_themselves_to_pointer_and_keyboard(show, site):
    driver = show(f"{site}/cable-0/report.html", PHONE)
    driver.execute_script("document.querySelector('.k0 .term').focus()")
    tip = one(driver, "#tip")
    assert tip.is_displayed()
    assert "pre-curvature" in tip.text
    assert tip.rect["x"] >= 0
    assert tip.rect["x"] + tip.rect["width"] <= PHONE


def test_every_control_is_reached_by_tab(show, site):
    driver = show(f"{site}/cable-0/report.html")
    reached = set()
    for _ in range(40):
        ActionChains(driver).send_keys(Keys.TAB).perform()
        reached.add(driver.execute_script("return document.activeElement.id || document.activeElement.className"))
    assert {"skip", "characteristic-stage", "photo-previous", "photo-choose", "photo-next", "photo-toggle"} <= reached


def test_dark_mode_changes_page_and_figures(show, site):
    driver = show(f"{site}/cable-0/report.html")
    colours = "return ['body', '#characteristic text'].map(q => getComputedStyle(document.querySelector(q))"
    colours += "[q === 'body' ? 'backgroundColor' : 'fill'])"
    light = driver.execute_script(colours)
    dark = {"features": [{"name": "prefers-color-scheme", "value": "dark"}]}
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", dark)
    assert all(a != b for a, b in zip(light, driver.execute_script(colours), strict=True))


def test_paper_shows_all_photos_and_no_controls(show, site):
    driver = show(f"{site}/cable-0/report.html")
    driver.execute_cdp_cmd("Emulation.setEmulatedMedia", {"media": "print"})
    assert len(shown(driver, "article.photo")) == 7
    assert not shown(driver, "nav, .stepper, #readout")


def visible_names(driver):
    return driver.execute_script(
        "return [...document.querySelectorAll('#specimens tbody tr:not([hidden])')].map(r => r.cells[1].textContent)"
    )


def printed(driver):
    """Number of texts on each page of the page as a PDF."""
    pdf = base64.b64decode(driver.execute_cdp_cmd("Page.printToPDF", {"preferCSSPageSize": True})["data"])
    objects = dict(re.findall(rb"\n(\d+) 0 obj(?:(?!endobj).)*?stream\r?\n(.*?)endstream", pdf, re.DOTALL))
    contents = re.findall(rb"/Contents (\d+) 0 R", pdf)
    return [len(re.findall(rb"T[jJ]\b", zlib.decompress(objects[number]))) for number in contents]


def test_the_printed_index_begins_below_its_title_and_repeats_its_head(show, site):
    """A table that is kept together leaves the first page to the title alone, and draws its rest under what follows."""
    driver = show(f"{site}/printed/index.html")
    whole = printed(driver)
    driver.execute_script("document.querySelector('main > section:last-child').remove()")
    table = printed(driver)
    assert len(table) == 2 and min(table) > 100
    assert whole[:2] == table
    driver.execute_script("document.querySelector('thead').style.visibility = 'hidden'")
    assert all(with_head > without for with_head, without in zip(table, printed(driver), strict=True))


def test_index_sorts_by_number_and_by_name(show, site):
    driver = show(f"{site}/index.html")
    heads = {
        button.text.split("\n")[0]: button for button in driver.find_elements(By.CSS_SELECTOR, "#specimens th button")
    }
    stiffness = next(button for text, button in heads.items() if text.startswith("f_EI, low"))
    stiffness.click()
    assert visible_names(driver)[:3] == ["cable-0", "cable-1", "cable-2"]
    assert stiffness.find_element(By.XPATH, "..").get_attribute("aria-sort") == "ascending"
    stiffness.click()
    assert visible_names(driver)[:2] == ["cable-18", "cable-17"]
    assert visible_names(driver)[-2:] == ["cable-9", "cable-19"]  # failed ones have no value and stay last
    heads["specimen"].click()
    assert visible_names(driver)[:3] == ["cable-0", "cable-1", "cable-2"]
    assert visible_names(driver)[-1] == "cable-19"


def test_index_searches_and_filters(show, site):
    driver = show(f"{site}/index.html")
    one(driver, "#search").send_keys("cable-1")
    assert visible_names(driver) == ["cable-1", *(f"cable-{i}" for i in range(10, 20))]
    Select(one(driver, "#status")).select_by_value("failed")
    assert visible_names(driver) == ["cable-19"]
    assert one(driver, "#shown").text == "1 of 20 shown."
    one(driver, "#search").clear()
    one(driver, "#search").send_keys(" ")
    Select(one(driver, "#status")).select_by_value("")
    Select(one(driver, "#type")).select_by_value("HV 1")
    assert visible_names(driver) == [f"cable-{i}" for i in range(1, 20, 3)]


def test_index_lays_selected_characteristics_over_each_other_and_leads_to_reports(show, site):
    driver = show(f"{site}/index.html")
    boxes = driver.find_elements(By.CSS_SELECTOR, "#specimens tbody input")
    assert len(boxes) == 18  # failed specimens have nothing to compare
    for box in (boxes[0], boxes[4]):
        box.click()
    assert len(shown(driver, "#overlay-plot path.curve")) == 2
    assert one(driver, "#overlay .key").text.split() == ["cable-0", "cable-4"]
    one(driver, "#clear").click()
    assert not shown(driver, "#overlay-plot path.curve")
    one(driver, "#select-all").click()
    assert len(shown(driver, "#overlay-plot path.curve")) == 18
    driver.find_element(By.LINK_TEXT, "cable-0").click()
    assert "Bending stiffness of cable-07" in driver.title


def test_five_thousand_rows_are_searched_and_sorted(show, site):
    driver = show(f"{site}/huge/index.html")
    assert len(visible_names(driver)) == 100
    one(driver, "#search").send_keys("cable-4999")
    assert visible_names(driver) == ["cable-4999"]
    assert one(driver, "#shown").text == f"1 of {MANY} shown."
    one(driver, "#search").clear()
    one(driver, "#search").send_keys(" ")
    driver.find_element(By.XPATH, "//th/button[starts-with(., 'f_EI, low')]").click()
    assert visible_names(driver)[:2] == ["cable-4999", "cable-4998"]
    Select(one(driver, "#status")).select_by_value("unusable")
    assert visible_names(driver) == [f"cable-{number}" for number in range(4950, 0, -100)]
    assert "<img src=x onerror=alert(1)></script>" in one(driver, "#specimens .why").text
    assert "data are at fault: 50." in one(driver, ".fault").text


def test_five_thousand_rows_are_drawn_where_the_reader_is(show, site):
    driver = show(f"{site}/huge/index.html")
    place = "const f = document.getElementById('specimens'); f.scrollTop = {} * f.scrollHeight"
    for share, seen in ((1.0, "cable-4999"), (0.5, "cable-2500"), (0.0, "cable-0")):
        driver.execute_script(place.format(share))
        WebDriverWait(driver, 20).until(lambda d, seen=seen: seen in visible_names(d))
    for share in range(20):
        driver.execute_script(place.format(share / 20))
        WebDriverWait(driver, 20).until(lambda d, seen=f"cable-{250 * share}": seen in visible_names(d))
    assert len(visible_names(driver)) <= 1500  # far rows are not kept


def test_a_tick_is_kept_where_its_row_is_drawn_again(show, site):
    driver = show(f"{site}/huge/index.html")
    one(driver, "#specimens tbody input").click()
    one(driver, "#search").send_keys("cable-7")
    assert one(driver, "#overlay .key").text == "cable-0"
    one(driver, "#search").clear()
    one(driver, "#search").send_keys(" ")
    assert one(driver, "#specimens tbody input").is_selected()


def test_first_rows_are_the_same_with_scripts_and_without(show, site):
    driver = show(f"{site}/huge/index.html")
    drawn = driver.execute_script("return document.querySelector('#specimens tbody tr').outerHTML")
    fetched = "const d = new DOMParser().parseFromString(arguments[0], 'text/html');"
    page = (Path(urlparse(site).path) / "huge/index.html").read_text(encoding="utf-8")
    before = driver.execute_script(f"{fetched} return d.querySelector('#specimens tbody tr').outerHTML", page)
    assert drawn.replace(' xmlns="http://www.w3.org/2000/svg"', "") == before
