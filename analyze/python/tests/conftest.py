"""The demo's machine and log."""

from pathlib import Path

import pytest

import tipwatch as tw

DEMO = Path(__file__).resolve().parents[3] / "analyze" / "demo"


@pytest.fixture(scope="session")
def machine():
    return tw.Machine(DEMO / "demo.toml")


@pytest.fixture(scope="session")
def analysis(machine):
    return tw.analyze(DEMO / "demo.mcap", machine)
