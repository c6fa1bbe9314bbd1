"""Items that hang, die or print cost themselves alone."""

import os
import sys
import threading
import time

from pipeline.batch.processes import OVER, deadline, in_processes
from pipeline.settings import BatchSettings


def worked(item, tell):
    tell("begun")
    if item == "dies":
        os._exit(1)
    if item == "prints":
        sys.stdout.write("a library speaks\n")
    with deadline(1.0):
        if item == "hangs":
            time.sleep(3600.0)
    return item, os.getpid()


def lost(item, code, started):
    return item, code


def test_an_item_that_hangs_or_dies_costs_itself_alone(capfd):
    items, stages = ["a", "prints", "dies", "b", "hangs", "c"], []
    done = dict(
        in_processes(
            worked,
            items,
            BatchSettings(workers=1),
            lost=lost,
            attempts=0,
            interrupted=threading.Event(),
            doing_now=lambda item, stage: stages.append(item),
        )
    )
    assert list(done) == stages == items
    assert (done["dies"], done["hangs"]) == (1, OVER)
    assert done["a"] == done["prints"]  # one process as long as it lives
    assert len({done["a"], done["b"], done["c"], os.getpid()}) == 4
    assert "a library speaks" not in capfd.readouterr().out
