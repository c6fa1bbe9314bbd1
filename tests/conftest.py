"""What becomes of the tests that need what a machine may lack: the shared specimens, and a browser.

The shared specimens are looked for in ``$CABLEBEND_SHARED``, then in ``shared`` beside the checkout. Without them the
tests marked ``shared`` are left out, and the head of the report says so and how to get them in.

Tests marked ``browser`` open a report in Chromium. Without it they do not run, and the last lines say how many and what
installs it; with ``CABLEBEND_BROWSER=required`` they fail instead.

Where ``CABLEBEND_UNTIL`` says a time (seconds since the epoch), the files that take minutes come last, and none of
their tests begins after it: CI has 90 minutes, and machines differ by a factor of three. The last lines name those that
did not run.
"""

import os
import shutil
import sys
import time
from pathlib import Path

import pytest

from pipeline.threads import keep_memory, one_thread

# before any test loads numpy: threads of two workers wait for each other, and a diagnosis takes three times the
# processor time; so the command does it, and so do its workers
one_thread()
keep_memory()

# tests start the program a hundred times: each would compile three hundred files anew
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

SHARED = Path(os.environ.get("CABLEBEND_SHARED", Path(__file__).resolve().parents[2] / "shared")) / "data"
BROWSER = {name: shutil.which(name) for name in ("chromium", "chromedriver")}
INSTALL = "apt-get install chromium chromium-driver (Debian)"


def pytest_report_header() -> str:
    if SHARED.is_dir():
        return f"shared specimens: {SHARED}"
    return f"shared specimens: none in {SHARED}; tests that read them are left out, set CABLEBEND_SHARED to run them"


TIMED = "CABLEBEND_UNTIL" in os.environ
UNTIL = float(os.environ.get("CABLEBEND_UNTIL", "inf"))
LATE = "no time left"

LONG = (
    "test_hidden_effects",
    "test_unnamed",
    "test_posterior",
    "test_faults",
    "test_two_causes",
    "test_by_step",
    "test_hostile",
    "test_free_profile",
    "test_displacement",
)
"""Files that take minutes, the longest first: a file goes to one worker, and one that came last would keep it alone."""


def turn(item) -> tuple[bool, int]:
    """When a test has its turn."""
    known = item.path.stem in LONG
    return known == TIMED, LONG.index(item.path.stem) if known else 0


def pytest_collection_modifyitems(config, items):
    items.sort(key=turn)
    if not SHARED.is_dir():
        left_out = [item for item in items if item.get_closest_marker("shared")]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]


def pytest_runtest_setup(item):
    if time.time() > UNTIL and item.path.stem in LONG:
        pytest.skip(LATE)
    missing = [name for name, path in BROWSER.items() if path is None]
    if missing and item.get_closest_marker("browser"):
        end = pytest.fail if os.environ.get("CABLEBEND_BROWSER") == "required" else pytest.skip
        end(f"{' and '.join(missing)} missing: {INSTALL}")


def pytest_terminal_summary(terminalreporter):
    skipped = terminalreporter.stats.get("skipped", ())
    late = [report.nodeid for report in skipped if LATE in str(report.longrepr)]
    if late:
        terminalreporter.section("time")
        terminalreporter.line(f"{len(late)} tests did not run, as it was later than CABLEBEND_UNTIL:")
        for test in late:
            terminalreporter.line(test)
    without = sum("browser" in report.keywords for report in skipped)
    if without:
        terminalreporter.section("browser")
        terminalreporter.line(f"{without} browser tests did not run: no Chromium with its driver was found;")
        terminalreporter.line(f"{INSTALL} lets them run")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the shared specimens and photographs."""
    return SHARED
