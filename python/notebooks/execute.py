"""Executes every notebook here and fails where a cell does: `python execute.py`. Nothing is written."""

import sys
import time
from pathlib import Path

import nbformat
from nbclient import NotebookClient

here = Path(__file__).parent
for path in sorted(here.glob("*.ipynb")):
    started = time.perf_counter()
    notebook = nbformat.read(path, as_version=4)
    if any(cell.get("outputs") for cell in notebook.cells):
        sys.exit(f"{path.name} has outputs: write it anew by make.py")
    NotebookClient(notebook, timeout=120, resources={"metadata": {"path": str(here)}}).execute()
    print(f"{path.name} holds ({time.perf_counter() - started:.1f} s)")
