import resource
import sys

import numpy as np
import pytest


@pytest.mark.skipif(sys.platform != "linux", reason="of glibc")
def test_memory_of_an_array_that_is_gone_serves_the_next():
    """`tests.conftest` asks for it, as workers do; the system had to clear 32 MB for every one."""
    np.ones(4_000_000)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
    for _ in range(20):
        np.ones(4_000_000)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before < 20
