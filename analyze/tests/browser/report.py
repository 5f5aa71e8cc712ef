"""Opens a report in headless Chromium as a reader does, and looks at what happens.

    pip install websocket-client
    python analyze/tests/browser/report.py REPORT.html [FOLDER]

Fails if the page has an error, asks for anything but itself, does not paint within two seconds, or if zoom
or time slider do not work. FOLDER receives pictures at three window widths and the printed page.
"""

import base64
import json
import shutil
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

try:
    import websocket
except ModuleNotFoundError:
    sys.exit("expected the Python package websocket-client, found none: pip install websocket-client")

WIDTHS = (420, 900, 1600)
SLOWEST_PAINT_MS = 2000
SLOWEST_FIGURES_S = 20


class Browser:
    def __init__(self, profile):
        program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
        if program is None:
            sys.exit("expected Chromium in PATH, found none")
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0",
                   "--remote-allow-origins=*", f"--user-data-dir={profile}", "about:blank"]
        self.process = subprocess.Popen([program, *options], stderr=subprocess.DEVNULL)
        port_file = Path(profile, "DevToolsActivePort")
        while not port_file.exists() or not port_file.read_text().strip():
            time.sleep(0.1)
        port = port_file.read_text().split()[0]
        pages = json.load(urllib.request.urlopen(f"http://127.0.0.1:{port}/json"))
        page = next(page for page in pages if page["type"] == "page")
        self.socket = websocket.create_connection(page["webSocketDebuggerUrl"], timeout=120)
        self.count, self.events = 0, []

    def ask(self, method, **parameters):
        self.count += 1
        self.socket.send(json.dumps({"id": self.count, "method": method, "params": parameters}))
        while True:
            answer = json.loads(self.socket.recv())
            if answer.get("id") == self.count:
                assert "error" not in answer, f"{method}: {answer['error']}"
                return answer["result"]
            self.events.append(answer)

    def close(self):
        """Ends it and waits for its other processes, which write into the profile to the last."""
        self.socket.send(json.dumps({"id": self.count + 1, "method": "Browser.close"}))
        try:
            self.process.wait(timeout=20)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()

    def wait_for(self, method):
        while not any(event.get("method") == method for event in self.events):
            self.events.append(json.loads(self.socket.recv()))

    def run(self, script):
        result = self.ask("Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True)
        assert "exceptionDetails" not in result, result
        return result["result"].get("value")


def check(browser, page):
    for domain in ("Page", "Runtime", "Network", "Log"):
        browser.ask(f"{domain}.enable")
    browser.ask("Page.navigate", url=page.as_uri())
    browser.wait_for("Page.loadEventFired")
    drawn = "document.querySelectorAll('div[id^=plot-]').length === document.querySelectorAll('.js-plotly-plot').length"
    started = time.monotonic()
    while not browser.run(drawn) and time.monotonic() - started < SLOWEST_FIGURES_S:
        time.sleep(0.1)
    print(f"all figures after {time.monotonic() - started:.1f} s")
    time.sleep(1.0)
    paint = browser.run("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    print(f"first paint after {paint:.0f} ms")
    assert paint < SLOWEST_PAINT_MS

    # every plot follows the one that is zoomed, and comes back
    ranges = "[...document.querySelectorAll('.js-plotly-plot')].map(p => p.layout.xaxis.range.map(Number))"
    whole = browser.run(ranges)
    assert whole, "no plots"
    low, high = whole[0]
    part = [low + 0.4 * (high - low), low + 0.6 * (high - low)]
    zoom = "Plotly.relayout(document.querySelector('.js-plotly-plot'), {}).then(() => new Promise(r => setTimeout(r, 1500)))"
    browser.run(zoom.replace("{}", json.dumps({"xaxis.range[0]": part[0], "xaxis.range[1]": part[1]})))
    for found in browser.run(ranges):
        assert all(abs(a - b) < 1e-6 * (high - low) for a, b in zip(found, part)), f"{found} of {part}"
    browser.run(zoom.replace("{}", '{"xaxis.autorange": true}'))
    print(f"{len(whole)} plots share zoom")

    # the slider moves the picture, the buttons step from event to event
    picture = "document.getElementById('moment').innerHTML + document.getElementById('moment-text').textContent"
    if browser.run("document.getElementById('moment-time') !== null"):
        before = browser.run(picture)
        browser.run("(s => { s.value = s.value === s.max ? s.min : s.max; s.dispatchEvent(new Event('input')) })"
                    "(document.getElementById('moment-time'))")
        moved = browser.run(picture)
        assert moved != before, "the slider does not move the picture"
        browser.run("document.getElementById('moment-before').click()")
        browser.run("document.getElementById('moment-after').click()")
        print("the slider moves the picture")
        for name in ("moment", "moment-side", "moment-space"):
            assert browser.run(f"document.getElementById('{name}').childElementCount") > 5, f"{name} is empty"
        space = "document.getElementById('moment-space').innerHTML"
        before = browser.run(space)
        browser.run("(s => { const e = (t, x) => s.dispatchEvent(new PointerEvent(t, { clientX: x, clientY: 9, pointerId: 1 }));"
                    "s.setPointerCapture = () => 0; e('pointerdown', 9); e('pointermove', 60); e('pointerup', 60) })"
                    "(document.getElementById('moment-space'))")
        assert browser.run(space) != before, "dragging does not turn the bodies"
        print("dragging turns the bodies")
    collisions(browser)

    for event in browser.events:
        kind, parameters = event.get("method"), event.get("params", {})
        assert kind != "Runtime.exceptionThrown", parameters
        assert not (kind == "Log.entryAdded" and parameters["entry"]["level"] == "error"), parameters
        if kind == "Network.requestWillBeSent":
            address = parameters["request"]["url"]
            assert address.startswith(("data:", "blob:")) or Path(address).parent.name == page.parent.name, address
    print("no errors, nothing from elsewhere")


def collisions(browser):
    """Labels of a picture from above or the side never cover each other."""
    found = browser.run("""[...document.querySelectorAll('svg.top-view:not(.turn)')].flatMap(svg => {
        const boxes = [...svg.querySelectorAll('text')].map(t => [t.textContent, t.getBoundingClientRect()]);
        return boxes.flatMap(([name, a], i) => boxes.slice(i + 1)
            .filter(([_, b]) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
                && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > a.height * 0.35)
            .map(([other]) => (svg.id || svg.getAttribute('aria-label')) + ': ' + name + ' / ' + other)); })""")
    assert not found, found
    print("no labels collide")


def pictures(browser, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for width in WIDTHS:
        browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=1000, deviceScaleFactor=1, mobile=False)
        time.sleep(1.5)
        wide = browser.run("document.documentElement.scrollWidth")
        assert wide <= width, f"at a width of {width} the page is {wide} wide"
        whole = browser.ask("Page.captureScreenshot", captureBeyondViewport=True,
                            clip={"x": 0, "y": 0, "width": width, "scale": 1,
                                  "height": min(browser.run("document.documentElement.scrollHeight"), 16000)})
        (folder / f"report_{width}.png").write_bytes(base64.b64decode(whole["data"]))
    browser.ask("Emulation.clearDeviceMetricsOverride")
    printed = browser.ask("Page.printToPDF", printBackground=True, paperWidth=8.27, paperHeight=11.69)
    (folder / "report.pdf").write_bytes(base64.b64decode(printed["data"]))
    print(f"pictures in {folder}")


def main():
    page = Path(sys.argv[1]).resolve()
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(profile)
        try:
            check(browser, page)
            if len(sys.argv) > 2:
                pictures(browser, Path(sys.argv[2]))
        finally:
            browser.close()


if __name__ == "__main__":
    main()
