"""What several tests of runs begin with."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where a run file may be written."""
    return tmp_path / "run.h5"


@pytest.fixture(scope="session")
def uncut(tmp_path_factory) -> Path:
    """The fake case, run without a break."""
    from fake_simulation import case
    from runs import run

    path = tmp_path_factory.mktemp("uncut") / "uncut.h5"
    run(case(), path)
    return path
