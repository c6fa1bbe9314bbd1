"""Where the shared specimens lie; tests that read them are left out, and counted as such, where there are none."""

import os
from pathlib import Path

import pytest

SHARED = Path(os.environ.get("CABLEBEND_SHARED", Path(__file__).parents[3] / "shared")) / "data"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect tests marked ``shared`` of this folder if there is no shared data."""
    here = Path(__file__).parent
    absent = [i for i in items if here in i.path.parents and i.get_closest_marker("shared") and not SHARED.is_dir()]
    if absent:
        config.hook.pytest_deselected(items=absent)
        items[:] = [item for item in items if item not in absent]


@pytest.fixture
def shared_data() -> Path:
    """Folder of the shared specimens."""
    return SHARED
