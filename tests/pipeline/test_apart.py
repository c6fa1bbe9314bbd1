"""Items that hang, die or print cost themselves alone."""

import os
import sys
import time

from pipeline.batch.apart import apart


def worked(item):
    if item == "hangs":
        time.sleep(3600.0)
    if item == "dies":
        os._exit(1)
    if item == "prints":
        sys.stdout.write("a library speaks\n")
    return item, os.getpid()


def lost(item, over):
    return item, "over" if over else "died"


def test_an_item_that_hangs_or_dies_costs_itself_alone():
    # Seconds enough for the module to load on a busy machine; only the item that hangs takes them.
    items = ["a", "prints", "dies", "b", "hangs", "c"]
    done = dict(apart(worked, items, seconds=10.0, lost=lost))
    assert list(done) == items
    assert (done["dies"], done["hangs"]) == ("died", "over")
    assert done["a"] == done["prints"]  # one process as long as it lives
    assert len({done["a"], done["b"], done["c"], os.getpid()}) == 4
