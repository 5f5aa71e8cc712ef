"""Executes the code cells of a notebook in order, in the current folder, without Jupyter.

    python book/notebooks/run.py book/notebooks/utilisation.ipynb
"""

import json
import sys
from pathlib import Path


def run(notebook):
    """The names that the notebook defines."""
    names = {"__name__": "__main__"}
    for number, cell in enumerate(json.loads(Path(notebook).read_text())["cells"]):
        if cell["cell_type"] == "code":
            exec(compile("".join(cell["source"]), f"{notebook}, cell {number}", "exec"), names)
    return names


if __name__ == "__main__":
    run(sys.argv[1])
