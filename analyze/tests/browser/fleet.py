"""The table and the chart of a fleet's page: `python fleet.py FLEET.html`.

Columns are sorted as they say, and what the chart of a machine shows is seen in light and in dark colours.
"""

import re
import sys
import tempfile
from pathlib import Path

from browser import Browser

# heads of the columns that are sorted, the last by its text, and what is said of a machine that nobody knows
WORDS = {
    "en": (("Lifted", "Speed", "Tilt"), "Doubt or failure", "unknown"),
    "de": (("Abgehoben", "Geschwindigkeit", "Schräglage"), "Zweifel oder Fehler", "unbekannt"),
}

# least contrast of what a chart shows to its background (WCAG 2, 1.4.11)
LEAST_CONTRAST = 3


def main(page):
    with tempfile.TemporaryDirectory() as profile:
        browser = Browser(profile)
        try:
            for domain in ("Page", "Runtime"):
                browser.ask(f"{domain}.enable")
            for theme in ("light", "dark"):
                features = [{"name": "prefers-color-scheme", "value": theme}]
                browser.ask("Emulation.setEmulatedMedia", features=features)
                browser.events.clear()
                browser.ask("Page.navigate", url=page.as_uri())
                browser.wait_for("Page.loadEventFired")
                while not browser.run("document.querySelectorAll('#explorer th button').length"):
                    pass
                numbers, texts, unknown = WORDS[browser.run("document.documentElement.lang")]
                for column in numbers:
                    sorts(browser, column, number, ["descending", "ascending"])
                sorts(browser, texts, str, ["ascending", "descending"])
                # a machine that nobody knows is none to choose
                choices = browser.run("[...document.querySelectorAll('#explorer td button')].map(button => button.textContent)")
                assert choices and unknown not in choices, choices
                shows(browser, theme)
        finally:
            browser.close()
    print("columns are sorted as they say, charts are seen in light and dark colours")


def number(cell):
    return float(re.match(r"[\d.,]*", cell)[0].replace(",", "."))


def sorts(browser, column, value, expected):
    heads = browser.run("[...document.querySelectorAll('#explorer th button')].map(head => head.textContent)")
    place = heads.index(column)
    said = []
    for _ in range(2):
        browser.run(f"document.querySelectorAll('#explorer th button')[{place}].click()")
        said.append(browser.run(f"document.querySelectorAll('#explorer th')[{place}].getAttribute('aria-sort')"))
        cells = browser.run(f"[...document.querySelectorAll('#explorer tbody tr')].map(row => row.cells[{place}].textContent)")
        # what is unknown comes last in both directions
        found = [value(cell) for cell in cells if cell]
        assert len(set(found)) > 1, f"{column}: expected logs that differ, found {found}"
        assert found == sorted(found, reverse=said[-1] == "descending"), f"{column}: {found} is not {said[-1]}"
    assert said == expected, f"{column}: expected {expected}, found {said}"


def shows(browser, theme):
    browser.run("document.querySelector('#explorer td button').click()")
    paper = browser.run("getComputedStyle(document.body).backgroundColor")
    drawn = browser.run("""[...document.querySelectorAll('.chart circle, .chart text, .chart polyline, .chart line[stroke-dasharray="4 3"]')]
        .map(shape => [shape.tagName, getComputedStyle(shape)[/line$/.test(shape.tagName) ? 'stroke' : 'fill']])""")
    assert {name for name, _ in drawn} == {"circle", "text", "polyline", "line"}, drawn
    for name, colour in drawn:
        assert contrast(colour, paper) >= LEAST_CONTRAST, f"{theme}: {name} in {colour} on {paper}"


def contrast(one, other):
    def luminance(colour):
        parts = [int(part) / 255 for part in re.findall(r"\d+", colour)[:3]]
        linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in parts]
        return sum(weight * part for weight, part in zip((0.2126, 0.7152, 0.0722), linear))

    dark, light = sorted([luminance(one), luminance(other)])
    return (light + 0.05) / (dark + 0.05)


if __name__ == "__main__":
    main(Path(sys.argv[1]).resolve())
