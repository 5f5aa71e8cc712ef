"""No message of the package repeats what is secret in a URL, whichever call was given it."""

import re
from pathlib import Path

import pytest

import tipwatch as tw

DATA = Path(__file__).resolve().parents[3] / "tests" / "data"
PASSWORD = "pass-word-of-me"
SIGNATURE = "0123456789abcdef-of-the-url"
# nothing answers at this port
URLS = [
    f"http://me:{PASSWORD}@127.0.0.1:9/a.mcap?sig={SIGNATURE}",
    f"ftp://me:{PASSWORD}@host/a b.mcap?sig={SIGNATURE}",
    f"s3://bucket/a.mcap?X-Amz-Signature={SIGNATURE}",
]


@pytest.fixture(autouse=True)
def one_attempt(monkeypatch):
    monkeypatch.setenv("TIPWATCH_STORAGE_ATTEMPTS", "1")
    monkeypatch.setenv("TIPWATCH_STORAGE_TIMEOUT", "2")


def calls(url, folder):
    log, machine = DATA / "tiny_lift.mcap", DATA / "tiny_lift.toml"
    return {
        "Machine": lambda: tw.Machine(url),
        "Machine urdf": lambda: tw.Machine(machine, url),
        "analyze": lambda: tw.analyze(url, machine),
        "analyze out": lambda: tw.analyze(log, machine, out=url, end=2.0),
        "analyze machine": lambda: tw.analyze(log, url),
        "read": lambda: tw.read(url, machine),
        "compare": lambda: tw.compare(url, log, machine=machine),
        "compare b": lambda: tw.compare(log, url, machine=machine),
        "whatif": lambda: tw.whatif(url, machine),
        "whatif out": lambda: tw.whatif(log, machine, out=url),
        "identify": lambda: tw.identify(machine, [url]),
        "identify out": lambda: tw.identify(machine, [], out=url),
        "screen": lambda: tw.screen(url, machine=machine, out=folder),
        "screen out": lambda: tw.screen(log, machine=machine, out=url),
        "screen fleet": lambda: tw.screen(log, fleet=url, out=folder),
    }


@pytest.mark.parametrize("url", URLS, ids=["http", "ftp", "s3"])
def test_no_call_repeats_a_secret(url, tmp_path, capfd):
    for name, call in calls(url, tmp_path).items():
        try:
            call()
        except tw.TipwatchError as error:
            said = f"{error!r} {error}"
            assert re.search("http|ftp|s3|machine|suspension|identify", said), name
        else:
            # a log that fails is no error of a screening: its record says why
            assert name.startswith("screen"), name
            said = "".join(path.read_bytes().decode("latin1") for path in tmp_path.rglob("*") if path.is_file())
        printed = "".join(capfd.readouterr())
        for secret in (PASSWORD, SIGNATURE):
            assert secret not in said + printed, (name, said, printed)


def test_the_program_inside_repeats_no_secret(capfd):
    from tipwatch._tipwatch import main

    for url in URLS:
        assert main(["tipwatch", "inspect", url]) != 0
    printed = "".join(capfd.readouterr())
    assert printed and PASSWORD not in printed and SIGNATURE not in printed


def test_urls_as_path_objects_are_refused():
    with pytest.raises(tw.TipwatchError, match="expected s3://… as text"):
        tw.analyze(Path("s3://bucket/a.mcap"), DATA / "tiny_lift.toml")
