"""The notebook of the book."""

import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[3]
sys.path.insert(0, str(ROOT / "book" / "notebooks"))


def test_the_map_meets_the_log_at_the_mark(tmp_path, monkeypatch, machine):
    pytest.importorskip("matplotlib").use("Agg")
    from run import run

    from tipwatch import _tipwatch

    monkeypatch.chdir(tmp_path)
    assert _tipwatch.main(["tipwatch", "--quiet", "demo", "--out", "demo"]) == 0
    found = run(ROOT / "book" / "notebooks" / "utilisation.ipynb")
    assert (tmp_path / "utilisation.png").stat().st_size > 10_000
    # the machine stood nearly still at the mark: the map of the leaning machine has the number of the log
    upright, leaning = found["maps"].values()
    row = np.abs(found["lifts"] - found["posture"][found["lift"]]).argmin()
    column = np.abs(found["slews"] - found["posture"][found["slew"]]).argmin()
    in_log = found["samples"]["utilisation"][found["worst"]]
    assert leaning[row, column] == pytest.approx(in_log, abs=0.05)
    assert upright[row, column] < in_log - 0.1
