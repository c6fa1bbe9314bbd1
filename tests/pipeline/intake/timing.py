"""How long a call takes, for tests that hold time in proportion to the size of the input."""

import time


def spent(work, *arguments):
    """Processor time of the quickest of three calls, s."""
    taken = []
    for _ in range(3):
        started = time.process_time()
        work(*arguments)
        taken.append(time.process_time() - started)
    return min(taken)
