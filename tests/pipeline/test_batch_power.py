"""Killed or without power between any two operations on files, a run or a report loses no stored result."""

import subprocess
import sys

import pytest

from tests.pipeline.cheap_batch import PATIENCE_S, ROOT

LEAST = {"run": 40, "report": 60}  # two results, one of two files new and one replaced, or both replaced, and an index


@pytest.mark.parametrize("action", LEAST)
def test_nothing_is_lost_wherever_it_is_cut_off(action, tmp_path):
    command = [sys.executable, "-m", "tests.pipeline.cut_batches", action, str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=3.0 * PATIENCE_S)
    assert done.returncode == 0, done.stderr
    counts = dict(line.split() for line in done.stdout.splitlines())
    assert set(counts) == {"killed", "power", "reordered"}
    assert min(map(int, counts.values())) >= LEAST[action]
