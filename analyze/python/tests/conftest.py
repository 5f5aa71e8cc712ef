"""The demo's machine and log."""

import os
import sys
from pathlib import Path

import pytest

# "python -m pytest" looks for packages in the working folder first, and in that of the sources finds the package without
# its extension, unless that was built in place
SOURCES = Path(__file__).resolve().parents[1]
if not list(SOURCES.glob("tipwatch/_tipwatch.*.so")):
    sys.path = [place for place in sys.path if Path(place).resolve() != SOURCES]
    os.environ["PYTHONSAFEPATH"] = "1"

import tipwatch as tw  # noqa: E402

DEMO = Path(__file__).resolve().parents[3] / "analyze" / "demo"


@pytest.fixture(scope="session")
def machine():
    return tw.Machine(DEMO / "demo.toml")


@pytest.fixture(scope="session")
def analysis(machine):
    return tw.analyze(DEMO / "demo.mcap", machine)
