"""Looks for what keeps readers out of a page: contrast, names, labels, order of headings, what a keyboard cannot reach.

    pip install websocket-client; pip install --no-deps axe-playwright-python
    python analyze/tests/browser/accessible.py PAGE.html...

The rules are those of axe-core, which that package carries; nothing of playwright is used. Each page is looked at with all
parts open, in light and in dark colours. Fails with what axe-core finds, however small.
"""

import json
import sys
import tempfile
import time
from importlib.util import find_spec
from pathlib import Path

from browser import Browser

RULES = """axe.run(document).then(found => JSON.stringify(found.violations.map(rule =>
    `${rule.impact}: ${rule.help}: ` + rule.nodes.slice(0, 3).map(node => node.html.slice(0, 200)).join(' '))))"""


def axe():
    found = find_spec("axe_playwright_python")
    if found is None:
        sys.exit("expected the Python package axe-playwright-python, found none: pip install --no-deps axe-playwright-python")
    return Path(found.origin).with_name("axe.min.js").read_text()


def accessible(browser):
    """Checks the page that the browser shows."""
    browser.run("document.querySelectorAll('details').forEach(part => { part.open = true })")
    browser.run(axe() + "; 0")
    for theme in ("light", "dark"):
        browser.run(f"document.documentElement.dataset.theme = '{theme}'")
        # colours may pass over into each other
        time.sleep(0.5)
        found = json.loads(browser.run(RULES))
        assert not found, f"{theme}: " + "; ".join(found)
    browser.run("delete document.documentElement.dataset.theme")
    print("axe-core finds nothing in light and dark colours")


def main():
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(profile)
        try:
            for domain in ("Page", "Runtime"):
                browser.ask(f"{domain}.enable")
            for page in map(Path, sys.argv[1:]):
                browser.events.clear()
                browser.ask("Page.navigate", url=page.resolve().as_uri())
                browser.wait_for("Page.loadEventFired")
                accessible(browser)
        finally:
            browser.close()


if __name__ == "__main__":
    main()
