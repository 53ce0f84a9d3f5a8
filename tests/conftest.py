"""What several tests of runs begin with."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from helpers.made_run import BENT


@pytest.fixture
def environment():
    """The environment, in which a command sets numbers of threads: that is undone."""
    before = dict(os.environ)
    yield os.environ
    os.environ.clear()
    os.environ.update(before)


@pytest.fixture
def here(tmp_path: Path, monkeypatch, environment) -> Path:
    """The folder in which a test is, with a case that is run in a moment."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bent.toml").write_text(BENT)
    return tmp_path


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """Where a run file may be written."""
    return tmp_path / "run.h5"


@pytest.fixture(scope="session")
def uncut(tmp_path_factory) -> Path:
    """The fake case, run without a break."""
    from helpers.fake_simulation import case
    from helpers.runs import run

    path = tmp_path_factory.mktemp("uncut") / "uncut.h5"
    run(case(), path)
    return path
