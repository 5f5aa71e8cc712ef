"""How smoothly the drawing of a report follows its slider: `frames.py REPORT.html...` moves it through the whole log and prints frames a second.

A measurement and no test, for it depends on the machine that runs it. The log of an hour is worth measuring: it has the most instants.
"""

import json
import sys
import tempfile
from pathlib import Path

from browser import Browser

# 60 frames a second leave so much for one (ms)
FRAME_MS = 1000 / 60
WIDTHS = {"wide": 1280, "telephone": 390}
MOVES = 300

# one move a frame; beside the frames what of their time the page takes itself: its script, and layout and styles after it
MOVE = """(async function (moves) {
  const slider = document.getElementById('moment-time');
  for (let at = slider; at; at = at.parentElement) if (at.tagName === 'DETAILS') at.open = true;
  slider.scrollIntoView({block: 'center'});
  const frame = function () { return new Promise(requestAnimationFrame); };
  for (let still = 0; still < 30; still++) await frame();
  const gaps = [], script = [], layout = [];
  let last = await frame();
  for (let move = 0; move <= moves; move++) {
    const from = performance.now();
    slider.value = Math.round(slider.min * 1 + (slider.max - slider.min) * move / moves);
    slider.dispatchEvent(new Event('input', {bubbles: true}));
    const done = performance.now();
    document.body.getBoundingClientRect();
    script.push(done - from);
    layout.push(performance.now() - done);
    const now = await frame();
    gaps.push(now - last);
    last = now;
  }
  return JSON.stringify({instants: slider.max - slider.min + 1, gaps: gaps, script: script, layout: layout});
})"""


def at_share(values, share):
    return sorted(values)[round(share * (len(values) - 1))]


def measure(browser, path, width):
    browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=width < 600)
    browser.events.clear()
    browser.ask("Page.navigate", url=Path(path).resolve().as_uri())
    browser.wait_for("Page.loadEventFired")
    return json.loads(browser.run(f"{MOVE}({MOVES})"))


def main():
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(profile)
        browser.ask("Page.enable")
        for path in sys.argv[1:]:
            print(f"{path}: {Path(path).stat().st_size / 1e3:.0f} kB")
            for name, width in WIDTHS.items():
                found = measure(browser, path, width)
                gaps = found["gaps"]
                late = sum(gap > 1.5 * FRAME_MS for gap in gaps)
                print(f"  {name}: {found['instants']} instants, {1000 * len(gaps) / sum(gaps):.1f} frames a second, "
                      f"gap {at_share(gaps, 0.5):.1f} ms (95 %: {at_share(gaps, 0.95):.1f}), {late} of {len(gaps)} late; "
                      + "; ".join(f"{of} {at_share(found[of], 0.5):.1f} ms (95 %: {at_share(found[of], 0.95):.1f})" for of in ("script", "layout")),
                      flush=True)
        browser.close()


if __name__ == "__main__":
    main()
