"""The test command on a machine without Chromium: it passes and says what did not run, or fails where that is asked."""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]


def ended(tmp_path, tests, **environment):
    """How tests end where no program is on the path: exit code and last lines."""
    own = {name: value for name, value in os.environ.items() if name != "CABLEBEND_BROWSER"}
    command = [sys.executable, "-m", "pytest", "-q", "-c", "pyproject.toml", "-p", "no:cacheprovider", *tests]
    environment = {**own, "PATH": str(tmp_path), **environment}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    return done.returncode, done.stdout.splitlines()[-4:]


def test_browser_tests_that_did_not_run_are_counted_in_the_last_lines(tmp_path):
    code, last = ended(tmp_path, ["tests/test_browser.py"])
    assert code == 0
    count = int(last[-1].split()[0])
    assert count >= 20 and f"{count} skipped" in last[-1]
    assert f"{count} browser tests did not run" in last[-3]
    assert "apt-get install chromium chromium-driver" in last[-2]


def test_their_absence_fails_where_they_are_required(tmp_path):
    one = tmp_path / "test_one.py"
    one.write_text("import pytest\n\n@pytest.mark.browser\ndef test_one():\n    pass\n")
    code, last = ended(tmp_path, ["-p", "tests.conftest", str(one)], CABLEBEND_BROWSER="required")
    assert code == 1 and "chromedriver missing" in last[-2] and "1 error" in last[-1]
