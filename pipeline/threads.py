"""One thread for every library of linear algebra and pictures, said before any of them is loaded.

Processes fill the cores, and threads of libraries beside them only wait for each other. More threads add up sums in
another order too: with one, the same input gives the same bytes in every process and on any number of cores. Who has
set a number of threads in the environment keeps it.
"""

from __future__ import annotations

import os

ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR")} | {
    "OPENCV_FOR_THREADS_NUM": "1"
}


def one_thread() -> None:
    """Ask the libraries that this process has not loaded yet for one thread each."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)
