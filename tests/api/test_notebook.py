"""The notebook of the documentation, run as a person runs it."""

import os
import sys
from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).resolve().parents[2] / "docs/notebooks/from-recording-to-finding.ipynb"


@pytest.fixture
def notebook():
    """Return the notebook."""
    return nbformat.read(NOTEBOOK, as_version=4)


def test_the_notebook_is_stored_without_outputs(notebook):
    """Those would be of another version one day; the test below makes them."""
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell for cell in code if cell.outputs or cell.execution_count] == []


@pytest.mark.slow
def test_the_notebook_finds_what_was_hidden(notebook, tmp_path, monkeypatch, children):
    """In a kernel of its own: tables, two plots, the effect by its name, a smaller gap, a page."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    before = children()
    client = NotebookClient(notebook, timeout=600, resources={"metadata": {"path": str(tmp_path)}})
    client.execute()
    assert children() <= before

    shown = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    assert sum("image/png" in output.get("data", {}) for output in shown) == 2
    assert [output for output in shown if output.get("name") == "stderr"] == []
    said = text_of(notebook, "zfcal.diagnose(")
    assert said.splitlines()[0] == "named"
    assert "alignment" in said
    gap = text_of(notebook, "zfcal.extend(")
    assert gap.splitlines()[0] == str(tmp_path / "recording" / "models" / "extended.toml")
    (row,) = [line.split() for line in gap.splitlines() if line.startswith("nats_per_step")]
    before_nats, after_nats = float(row[1]), float(row[2])
    assert after_nats > before_nats
    assert "recording/report/index.html" in text_of(notebook, "zfcal.report(")
    assert (tmp_path / "recording" / "report" / "index.html").is_file()


def text_of(notebook, call):
    """Return what the cell with a call shows, as text."""
    (cell,) = [cell for cell in notebook.cells if call in cell.source and cell.cell_type == "code"]
    return "\n".join(
        output.text if output.output_type == "stream" else output.data["text/plain"]
        for output in cell.outputs
    )
