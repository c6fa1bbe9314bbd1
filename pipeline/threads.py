"""How libraries of linear algebra and pictures use a process: one thread each, and memory that is kept.

Processes fill the cores, and threads of libraries beside them only wait for each other. More threads add up sums in
another order too: with one, the same input gives the same bytes in every process and on any number of cores. Who has
set a number of threads in the environment keeps it.

Arrays of some ten megabytes come and go by the hundred. The C library gives each back to the system, which clears it
for the next: a fifth of the processor time of a diagnosis.
"""

from __future__ import annotations

import ctypes
import os
import sys

ONE_THREAD = {f"{library}_NUM_THREADS": "1" for library in ("OMP", "OPENBLAS", "MKL", "NUMEXPR")} | {
    "OPENCV_FOR_THREADS_NUM": "1"
}


def one_thread() -> None:
    """Ask the libraries that this process has not loaded yet for one thread each."""
    for name, value in ONE_THREAD.items():
        os.environ.setdefault(name, value)


TRIM, MAP = -1, -3  # M_TRIM_THRESHOLD, M_MMAP_THRESHOLD of <malloc.h>
KEPT_MB, ARRAY_MB = 256, 64
"""Free memory that a process keeps, and arrays from which on it does not: a photo of 64 Mpx is larger."""


def keep_memory() -> None:
    """Keep freed arrays for the next ones, where the C library is glibc; elsewhere nothing happens."""
    if sys.platform == "linux" and (mallopt := getattr(ctypes.CDLL(None), "mallopt", None)):
        mallopt(TRIM, KEPT_MB << 20)
        mallopt(MAP, ARRAY_MB << 20)
