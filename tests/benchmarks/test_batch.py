"""Batches: a thousand specimens, two workers against one, and the memory of the process that hands them out.

Run with ``--benchmark-enable`` on a machine with two idle cores. Without it, ten specimens show that the roads work
and nothing is said about speed.
"""

import itertools
import time

import psutil
import pytest

from tests.pipeline.cheap_batch import run_cheaply, write_specimens

RATE_GAIN = 1.8
MEMORY_GROWTH_MB = 200.0
DELAY_S = 0.3  # a thirtieth of a real specimen: the cost of handing out weighs thirty times more here


@pytest.fixture
def linked(tmp_path):
    """Makes batches of ten specimens linked under other names."""
    write_specimens(tmp_path / "ten", [f"r{n}" for n in range(10)], notes=f"delay {DELAY_S}")

    def make(count):
        batch = tmp_path / f"batch-{count}"
        batch.mkdir()
        for number in range(count):
            (batch / f"s{number:04d}").symlink_to(tmp_path / "ten" / f"r{number % 10}")
        return batch

    return make


def rate(batch, out, workers):
    """Specimens per second once all workers are busy."""
    ends = []
    tally = run_cheaply(batch, out, workers=workers, on_outcome=lambda outcome, tally: ends.append(time.monotonic()))
    assert (tally.measured, tally.failed) == (tally.total, 0)
    warm = 2 * workers
    return (len(ends) - warm - 1) / (ends[-1] - ends[warm])


def test_two_workers_against_one(benchmark, linked, tmp_path):
    batch = linked(100 if benchmark.enabled else 10)
    two = benchmark.pedantic(rate, args=(batch, tmp_path / "two", 2), rounds=1)
    if benchmark.enabled:
        one = rate(batch, tmp_path / "one", 1)
        benchmark.extra_info["gain"] = two / one
        assert two > RATE_GAIN * one


def test_memory_of_the_coordinator_is_flat(benchmark, linked, tmp_path):
    batch = linked(1000 if benchmark.enabled else 10)
    me, used = psutil.Process(), []

    def watch(outcome, tally):
        used.append(me.memory_info().rss / 1e6)

    benchmark.pedantic(run_cheaply, args=(batch, tmp_path / "out"), kwargs={"on_outcome": watch}, rounds=1)
    growth = max(itertools.chain(used, [0.0])) - used[0]
    benchmark.extra_info["growth_MB"] = growth
    assert growth < MEMORY_GROWTH_MB
