"""A notebook, run by a real Jupyter kernel: what its cells show."""

from __future__ import annotations

from pathlib import Path

import nbformat
import numpy as np
import pytest
from nbclient import NotebookClient

import ibfil

CELLS = {
    "case": 'import ibfil\ncase = ibfil.read_case("swimmer_rft", {"time.end": "4*pi/10"})\ncase',
    "result": 'result = ibfil.run(case, "swum.h5")\nresult',
    "numbers": "result.summaries, result.checks",
    "run": 'run = ibfil.open("swum.h5")\nrun',
    "plot": "run.plot()",
    "xarray": """bends = run.to_xarray().swimmer_strain.sel(frame="e1")
float(bends.sel(swimmer_arclength=0.5, method="nearest")[0])""",
    "there": 'ibfil.run(case, "swum.h5")',
    "bad": 'case.with_({"time.ed": 2})',
    "frozen": "case.time.end = 3",
    "position": 'result.series("speed")',
    "other": """short = case.with_({"time.end": 0.1})
ibfil.run(short, "swum.h5", overwrite=True, progress=False).times[-1].item()""",
    "closed": "run.close()\nrun.status",
}


@pytest.fixture(scope="module")
def shown(tmp_path_factory) -> dict[str, list]:
    """The outputs of each cell."""
    folder = tmp_path_factory.mktemp("notebook")
    notebook = nbformat.v4.new_notebook(cells=[nbformat.v4.new_code_cell(cell) for cell in CELLS.values()])
    here = str(Path(ibfil.__file__).parents[1])
    notebook.cells[0].source = f"import sys; sys.path.insert(0, {here!r})\n" + notebook.cells[0].source
    NotebookClient(notebook, allow_errors=True, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    return dict(zip(CELLS, (cell.outputs for cell in notebook.cells), strict=True))


def data(outputs: list) -> dict[str, str]:
    """The value of a cell, by the kind of its form."""
    assert [one.output_type for one in outputs if one.output_type != "stream"] == ["execute_result"], outputs
    assert not [one for one in outputs if one.output_type == "stream" and one.name == "stderr"]
    return outputs[-1].data


def test_cases_results_and_runs_are_lines_and_tables(shown):
    for cell, line, inside in (
        ("case", "<Case ", "8*sin(4*pi*s - 10*t)"),
        ("result", "<Result finished: 480 steps, t = 1.25664; speed = -0.10", "<td>speed</td>"),
        ("run", "<Run swum.h5: finished, 81 outputs, t = 0 to 1.25664; swimmer (64 nodes)>", "speed"),
    ):
        value = data(shown[cell])
        assert value["text/plain"].startswith(line)
        assert inside in value["text/html"]
    assert "<-0.10" in data(shown["numbers"])["text/plain"]
    assert data(shown["plot"])["image/png"]
    assert float(data(shown["xarray"])["text/plain"]) == pytest.approx(8 * np.sin(2 * np.pi * 32 / 31.5), abs=0.02)
    assert float(data(shown["other"])["text/plain"]) == 0.1


def test_a_run_says_its_groups_and_has_a_bar(shown):
    said = "".join(one.text for one in shown["result"] if one.output_type == "stream")
    assert "sperm number = " in said
    assert "warning: observe.speed.over: it ends at 1.88496, beyond time.end = 1.25664" in said
    assert "of 1.257 [" in said


@pytest.mark.parametrize(
    ("cell", "told"),
    [
        ("there", "swum.h5: exists already; overwrite=True writes over it"),
        ("bad", 'time.ed: found an unknown key; did you mean "end"?'),
        ("frozen", "end: a case does not change; one with other values is case.with_({...})"),
        ("position", "speed has no series; there are speed.position, sideways.position"),
        ("closed", "the run file is closed; ibfil.open opens it again"),
    ],
)
def test_errors_are_a_sentence_in_the_words_of_python(shown, cell, told):
    (error,) = shown[cell]
    assert error.output_type == "error"
    assert told in error.evalue
    assert "--" not in error.evalue
