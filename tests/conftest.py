"""Where the shared specimens lie, and what becomes of the tests that read them on a machine without them.

They are looked for in ``$CABLEBEND_SHARED``, then in ``shared`` beside the checkout. Without them the tests marked
``shared`` are left out, and the head of the report says so and how to get them in.
"""

import os
from pathlib import Path

import pytest

SHARED = Path(os.environ.get("CABLEBEND_SHARED", Path(__file__).resolve().parents[2] / "shared")) / "data"


def pytest_report_header() -> str:
    if SHARED.is_dir():
        return f"shared specimens: {SHARED}"
    return f"shared specimens: none in {SHARED}; tests that read them are left out, set CABLEBEND_SHARED to run them"


def pytest_collection_modifyitems(config, items):
    if SHARED.is_dir():
        return
    left_out = [item for item in items if item.get_closest_marker("shared")]
    config.hook.pytest_deselected(items=left_out)
    items[:] = [item for item in items if item not in left_out]


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of the shared specimens and photographs."""
    return SHARED
