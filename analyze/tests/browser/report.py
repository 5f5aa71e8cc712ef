"""Opens a report in headless Chromium as a reader does, and looks at what happens.

    pip install websocket-client; pip install --no-deps axe-playwright-python
    python analyze/tests/browser/report.py REPORT.html [FOLDER]

Fails if the page has an error, asks for anything but itself, does not paint within two seconds, if zoom, time slider or
sliders of a change do not work, if anything overflows, collides, is blank or has no name, or if the summary is longer than a sheet of paper or has
pictures that nobody can read on it. FOLDER receives pictures at three window widths and the printed page.
"""

import base64
import re
import sys
import tempfile
import time
from pathlib import Path

from accessible import accessible
from browser import Browser

WIDTHS = (420, 900, 1600)
SLOWEST_PAINT_MS = 2000
SLOWEST_FIGURES_S = 20
LEAST_LETTERS_PT = 5.2


def check(browser, page):
    for domain in ("Page", "Runtime", "Network", "Log"):
        browser.ask(f"{domain}.enable")
    browser.ask("Page.navigate", url=page.as_uri())
    browser.wait_for("Page.loadEventFired")
    shared = browser.run("document.querySelector('script[src]') !== null")
    assert browser.run("document.getElementById('no-library')?.hidden ?? true"), "the shared scripts are missing"
    drawn = "Number(document.documentElement.dataset.plots) === document.querySelectorAll('div[id^=plot-]').length"
    started = time.monotonic()
    while not browser.run(drawn) and time.monotonic() - started < SLOWEST_FIGURES_S:
        time.sleep(0.1)
    print(f"all figures after {time.monotonic() - started:.1f} s")
    time.sleep(1.0)
    paint = browser.run("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    print(f"first paint after {paint:.0f} ms")
    assert paint < SLOWEST_PAINT_MS

    # every part opens, and every plot draws something
    browser.run("document.querySelectorAll('details').forEach(d => { d.open = true })")
    browser.run("new Promise(done => setTimeout(() => { drawPlots(); done() }, 500))")
    blank = browser.run("""[...document.querySelectorAll('.plot canvas')].filter(canvas => {
        const data = canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data;
        const colours = new Set();
        for (let k = 0; k < data.length; k += 4) { colours.add(data[k] << 16 | data[k + 1] << 8 | data[k + 2]); }
        return colours.size < 8; }).map(canvas => canvas.parentElement.id)""")
    assert not blank, f"nothing is drawn in {blank}"

    # all plots share the time axis: the keyboard zooms and shows all again
    low, high = browser.run("plotView()")
    key = "(k => document.querySelector('.plot').dispatchEvent(new KeyboardEvent('keydown', { key: k })))"
    browser.run(key + "('+')")
    zoomed = browser.run("plotView()")
    assert abs((zoomed[1] - zoomed[0]) / (high - low) - 0.5) < 1e-6, zoomed
    browser.run(key + "('0')")
    assert browser.run("plotView()") == [low, high]
    print("plots share zoom")

    # a name in a legend hides its curve
    pressed = "document.querySelector('.legend button').getAttribute('aria-pressed')"
    before = browser.run(pressed)
    browser.run("document.querySelector('.legend button').click()")
    assert browser.run(pressed) != before

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
    sliders(browser)
    collisions(browser)
    whole_sheet(browser)
    accessible(browser)
    for width in WIDTHS:
        overflow(browser, width)
    names(browser)
    first_sheet(browser)

    # reports of a fleet share their scripts in the folder above
    here = (page.parent.name, page.parent.parent.name) if shared else (page.parent.name,)
    for event in browser.events:
        kind, parameters = event.get("method"), event.get("params", {})
        assert kind != "Runtime.exceptionThrown", parameters
        assert not (kind == "Log.entryAdded" and parameters["entry"]["level"] == "error"), parameters
        if kind == "Network.requestWillBeSent":
            address = parameters["request"]["url"]
            assert address.startswith(("data:", "blob:")) or Path(address).parent.name in here, address
    print("no errors, nothing from elsewhere")


def sliders(browser):
    """A slider shows what was simulated at its values, and between two of them the straight line; its button shows the log again."""
    facts = browser.run("JSON.parse(document.getElementById('what-if-data')?.textContent ?? 'null')")
    if facts is None:
        return
    begin, end = browser.run("document.getElementById('what-if-result').dataset.result").split("{otf}")
    logged = facts["logged"]["otf_n"]

    def shown():
        text = browser.run("document.getElementById('what-if-result').textContent")
        assert text.startswith(begin), text
        number = re.match(r"-?\d+", text[len(begin):])
        assert number and end.split("{")[0] in text, text
        return int(number.group())

    def move(place, at):
        moved = (f"(s => {{ s.value = {at}; s.dispatchEvent(new Event('input')); return Number(s.value) }})"
                 f"(document.getElementById('what-if-{place}'))")
        return browser.run(moved)

    assert abs(shown() - logged) <= 0.5 + 1e-6, (shown(), logged)
    tried = 0
    for place, change in enumerate(facts["changes"]):
        points = change["simulated"]
        for point in points:
            move(place, point["at"])
            assert abs(shown() - point["otf_n"]) <= 0.5 + 1e-6, (change["name"], point, shown())
            tried += 1
        for a, b in zip(points, points[1:]):
            # a third of the way, to the next step of the input
            at = move(place, a["at"] + (b["at"] - a["at"]) / 3)
            line = a["otf_n"] + (b["otf_n"] - a["otf_n"]) * (at - a["at"]) / (b["at"] - a["at"])
            assert abs(shown() - line) <= 0.5 + 1e-6, (change["name"], at, line, shown())
        browser.run("document.getElementById('what-if-reset').click()")
        assert abs(shown() - logged) <= 0.5 + 1e-6, (change["name"], shown(), logged)
    assert tried >= 6, facts
    print(f"sliders show {tried} simulated values and the lines between them")


def collisions(browser):
    """Labels of a picture or a chart never cover each other."""
    found = browser.run("""[...document.querySelectorAll('svg.top-view:not(.turn), svg.chart')].flatMap(svg => {
        const boxes = [...svg.querySelectorAll('text')].map(t => [t.textContent, t.getBoundingClientRect()]);
        return boxes.flatMap(([name, a], i) => boxes.slice(i + 1)
            .filter(([_, b]) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
                && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > a.height * 0.35)
            .map(([other]) => (svg.id || svg.getAttribute('aria-label')) + ': ' + name + ' / ' + other)); })""")
    assert not found, found
    print("no labels collide")


def whole_sheet(browser):
    """Every cell of the summary is there for pictures and copies of the whole page, however small the window."""
    browser.ask("Emulation.setDeviceMetricsOverride", width=420, height=300, deviceScaleFactor=1, mobile=True)
    time.sleep(0.5)
    missing = browser.run("""(() => { const sheet = document.querySelector('.sheet'), flat = text => text.replace(/\\s+/g, '');
        const seen = flat(sheet.innerText);
        return [...sheet.querySelectorAll('td, th')].map(cell => flat(cell.textContent)).filter(cell => !seen.includes(cell)); })()""")
    browser.ask("Emulation.clearDeviceMetricsOverride")
    assert not missing, f"not drawn in the summary: {missing}"
    print("nothing of the summary waits to be scrolled to")


def overflow(browser, width):
    """Nothing is wider than the window but what scrolls in itself, and no text is cut off or missing."""
    browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=1000, deviceScaleFactor=1, mobile=width < 600)
    time.sleep(0.8)
    found = browser.run("""(() => { const wide = document.documentElement.clientWidth, faults = [];
        if (document.documentElement.scrollWidth > wide) { faults.push('page ' + document.documentElement.scrollWidth); }
        document.querySelectorAll('main *').forEach(e => {
            if (e.closest('.wide') && !e.matches('.wide') || e.closest('svg')) { return; }
            const box = e.getBoundingClientRect();
            if (box.width && (box.right > wide + 1 || box.left < -1)) { faults.push(e.tagName + '.' + e.className + ' ' + Math.round(box.right)); }
            if (!e.matches('.wide') && e.scrollWidth > e.clientWidth + 2 && getComputedStyle(e).overflowX === 'hidden') {
                faults.push('cut ' + e.tagName + '.' + e.className); } });
        return faults.slice(0, 10); })()""")
    browser.ask("Emulation.clearDeviceMetricsOverride")
    assert not found, f"at a width of {width}: {found}"
    print(f"nothing overflows at a width of {width}")


def names(browser):
    """Every plot has a name for a screen reader, and every name of an element is its own."""
    found = browser.run("""(() => {
        const faults = [...document.querySelectorAll('.plot:not([aria-label], [aria-labelledby])')].map(plot => plot.id);
        const ids = [...document.querySelectorAll('[id]')].map(e => e.id);
        return faults.concat(ids.filter((id, k) => ids.indexOf(id) !== k)); })()""")
    assert not found, found
    print("everything has a name")


def first_sheet(browser):
    """The summary is one sheet of A4: with the margins of print, 186 by 273 mm at 96 dots per inch. Its pictures can be read."""
    browser.ask("Emulation.setEmulatedMedia", media="print")
    browser.ask("Emulation.setDeviceMetricsOverride", width=703, height=1032, deviceScaleFactor=1, mobile=False)
    time.sleep(0.5)
    height = browser.run("document.querySelector('.sheet').getBoundingClientRect().bottom")
    letters = browser.run("""[...document.querySelectorAll('.sheet svg')].flatMap(svg => {
        const box = svg.getBoundingClientRect(), view = svg.viewBox.baseVal;
        const scale = Math.min(box.width / view.width, box.height / view.height);
        return [...svg.querySelectorAll('text')].map(t => [0.75 * scale * parseFloat(getComputedStyle(t).fontSize), t.textContent]); })""")
    browser.ask("Emulation.clearDeviceMetricsOverride")
    browser.ask("Emulation.setEmulatedMedia", media="")
    assert height <= 1032, f"the summary is {height:.0f} of 1032 dots high"
    print(f"the summary takes {height:.0f} of 1032 dots")
    small = [(size, text) for size, text in letters if size < LEAST_LETTERS_PT]
    assert not small, f"letters of pictures on paper have less than {LEAST_LETTERS_PT} points: {small}"
    print(f"letters of {len(letters)} texts in pictures can be read on paper")


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
