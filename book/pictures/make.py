"""Makes the pictures of README and book from the program's own output.

    pip install pyte pillow matplotlib polars websocket-client ./python
    cargo build --workspace --bins
    python book/pictures/make.py [FOLDER OF THE PROGRAMS]

Needs Chromium in PATH. The figures of the two papers have scripts of their own in tests/figures.
"""

import base64
import io
import os
import pty
import select
import shutil
import struct
import subprocess
import sys
import tempfile
import termios
import time
from fcntl import ioctl
from html import escape
from pathlib import Path

import pyte
from PIL import Image

ROOT = Path(__file__).resolve().parents[2]
DATA = ROOT / "tests" / "data"
OUT = ROOT / "book" / "src" / "pictures"
PROGRAMS = Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "target" / "debug").resolve()
TIPWATCH, LIVE = PROGRAMS / "tipwatch", PROGRAMS / "tipwatch-live"
LARGEST_BYTES = 300_000
# Kinds of machines whose pictures the book shows
SHEETS = ["forklift", "forwarder", "mobile-crane", "crawler-excavator"]
# Columns and rows of the terminal
COLUMNS, ROWS = 100, 25
# Seconds of the replay after which the terminal is drawn: a wheel is about to lift
DRAWN_AFTER_S = 1.0


def main():
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        run(TIPWATCH, "--quiet", "demo", "--out", "demo", within=folder)
        first_sheet(folder / "demo" / "report.html", OUT / "report.png", folder)
        fleet(folder)
        screenshot(folder / "fleet" / "fleet.html", OUT / "fleet.png", 1100, 1000, folder)
        (OUT / "watch.svg").write_text(watch(folder))
        for template in SHEETS:
            from_sheet(folder, template)
        of_python(folder)


def first_sheet(page, out, folder):
    """The summary of a report as it is printed."""
    sys.path.insert(0, str(ROOT / "analyze" / "tests" / "browser"))
    from browser import Browser

    scale, width, margin = 1.5, 688, 20
    browser = Browser(folder / "browser")
    browser.ask("Page.enable")
    browser.ask("Emulation.setEmulatedMedia", media="print")
    browser.ask("Emulation.setDeviceMetricsOverride", width=width, height=1032, deviceScaleFactor=scale, mobile=True)
    browser.ask("Page.navigate", url=page.as_uri())
    browser.wait_for("Page.loadEventFired")
    time.sleep(2)
    height = browser.run("document.querySelector('.sheet').getBoundingClientRect().bottom")
    shot = base64.b64decode(browser.ask("Page.captureScreenshot")["data"])
    browser.close()
    shot = Image.open(io.BytesIO(shot)).convert("RGB").crop((0, 0, round(width * scale), round(height * scale)))
    framed = Image.new("RGB", (shot.width + 2 * margin, shot.height + 2 * margin), "white")
    framed.paste(shot, (margin, margin))
    framed.quantize(128, dither=Image.Dither.NONE).save(out, optimize=True)


def from_sheet(folder, template):
    """The picture of a machine that is made from its example sheet."""
    sheet, out = folder / f"{template}.toml", folder / template
    sheet.write_bytes(subprocess.run([TIPWATCH, "machine", "example", template], stdout=subprocess.PIPE, check=True).stdout)
    run(TIPWATCH, "--quiet", "machine", "new", sheet, "--out", out)
    shutil.copy(out / "machine.svg", OUT / f"sheet_{template}.svg")


def of_python(folder):
    """The figure of the notebook and the drawing of a machine; tipwatch must be importable (PYTHONPATH)."""
    folder = folder / "python"
    folder.mkdir()
    run(TIPWATCH, "--quiet", "demo", "--out", folder / "demo")
    script = (f"import sys; sys.path.insert(0, {str(ROOT / 'book' / 'notebooks')!r}); import run; "
              f"run.run({str(ROOT / 'book' / 'notebooks' / 'utilisation.ipynb')!r})")
    of_machine = (f"import tipwatch; machine = tipwatch.Machine({str(DATA / 'crane.toml')!r}); "
                  "machine.draw().savefig('machine.png', dpi=80)")
    for code, picture in [(script, "utilisation"), (of_machine, "machine")]:
        subprocess.run([sys.executable, "-c", code], cwd=folder, env={**os.environ, "MPLBACKEND": "Agg"}, check=True)
        found = Image.open(folder / f"{picture}.png").convert("RGB").quantize(128, dither=Image.Dither.NONE)
        found.save(OUT / f"python_{picture}.png", optimize=True)


def run(*command, within=None):
    # a finding or a lost message is no failure
    done = subprocess.run([str(c) for c in command], cwd=within, stdout=subprocess.DEVNULL)
    assert done.returncode in (0, 3), f"{command}: exit code {done.returncode}"


def fleet(folder):
    """Logs of several machines as a fleet; each has its machine file beside it."""
    logs, rules = folder / "logs", []
    logs.mkdir()
    for name in ["tiny", "tiny_lift", "swing_lift", "hard_brake", "lift_payload", "forwarder6", "forwarder6_bump",
                 "second_paper", "folded_arm"]:
        shutil.copy(DATA / f"{name}.mcap", logs)
        rules.append(f'[[machine]]\nfile = "{DATA / name}.toml"\npath = "**/{name}.mcap"\n')
    (folder / "fleet.toml").write_text("".join(rules))
    run(TIPWATCH, "--quiet", "screen", logs, "--fleet", folder / "fleet.toml", "--out", folder / "fleet")


def screenshot(page, picture, width, height, folder):
    program = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    assert program, "expected Chromium in PATH, found none"
    options = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
               "--disable-background-networking", "--disable-component-update", "--disable-sync",
               "--hide-scrollbars", "--virtual-time-budget=10000", f"--window-size={width},{height}",
               f"--user-data-dir={folder / 'browser'}", f"--screenshot={picture}", page.as_uri()]
    subprocess.run([program, *options], check=True, stderr=subprocess.DEVNULL)
    # a page has few colours: a palette keeps the file small
    Image.open(picture).convert("RGB").quantize(128, dither=Image.Dither.NONE).save(picture, optimize=True)
    assert picture.stat().st_size < LARGEST_BYTES, f"{picture}: {picture.stat().st_size} bytes"


def watch(folder):
    """The terminal of `tipwatch-live watch` beside a monitor and a replay, as SVG."""
    prefix = f"picture_{os.getpid()}_"
    machine = ["--machine", DATA / "tiny_lift.toml", "--prefix", prefix]
    monitor = subprocess.Popen([LIVE, "monitor", "--quiet", *machine], stderr=subprocess.DEVNULL)
    process, terminal = pty.fork()
    if process == 0:
        os.environ["TERM"] = "xterm-256color"
        os.execv(LIVE, [str(LIVE), "watch", "--prefix", prefix])
    ioctl(terminal, termios.TIOCSWINSZ, struct.pack("HHHH", ROWS, COLUMNS, 0, 0))
    screen = pyte.Screen(COLUMNS, ROWS)
    stream = pyte.ByteStream(screen)
    read_for(1.0, terminal, stream)
    replay = subprocess.Popen([LIVE, "replay", DATA / "tiny_lift.mcap", "--wait", "10", *machine], stderr=subprocess.DEVNULL)
    read_for(DRAWN_AFTER_S + 0.5, terminal, stream)
    picture = drawn(screen)
    os.write(terminal, b"q")
    for program in (replay, monitor):
        program.wait(timeout=60)
    os.waitpid(process, 0)
    return picture


def read_for(seconds, terminal, stream):
    end = time.monotonic() + seconds
    while (left := end - time.monotonic()) > 0:
        if select.select([terminal], [], [], left)[0]:
            stream.feed(os.read(terminal, 65536))


def drawn(screen):
    """The screen as SVG: one text for each run of cells of one look."""
    wide, high = 8.4, 18
    colours = {"default": "#d8d8d8", "black": "#1e1e1e", "red": "#e06c75", "green": "#98c379", "brown": "#e5c07b",
               "yellow": "#e5c07b", "blue": "#61afef", "magenta": "#c678dd", "cyan": "#56b6c2", "white": "#ffffff",
               "brightblack": "#808080", "brightred": "#ff7b86", "brightgreen": "#b5e890", "brightyellow": "#ffd68a",
               "brightblue": "#82cfff", "brightcyan": "#7fdbe6", "brightmagenta": "#e6a0ff", "brightwhite": "#ffffff"}

    def colour(name, default):
        if name == "default":
            return default
        return colours.get(name, f"#{name}" if len(name) == 6 else default)

    last = max((row for row in range(ROWS) if screen.display[row].strip()), default=0)
    height = (last + 1) * high + 16
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {COLUMNS * wide + 16:.0f} {height}" '
             'font-family="DejaVu Sans Mono, Menlo, Consolas, monospace" font-size="14">',
             '<rect width="100%" height="100%" rx="6" fill="#1e1e1e"/>']
    for row in range(last + 1):
        column = 0
        while column < COLUMNS:
            cell, start, text = screen.buffer[row][column], column, ""
            look = (cell.fg, cell.bg, cell.bold, cell.reverse)
            while column < COLUMNS:
                next_cell = screen.buffer[row][column]
                if (next_cell.fg, next_cell.bg, next_cell.bold, next_cell.reverse) != look:
                    break
                text += next_cell.data
                column += 1
            fore, back = colour(cell.fg, "#d8d8d8"), colour(cell.bg, "#1e1e1e")
            if cell.reverse:
                fore, back = back, fore
            x, y = 8 + start * wide, 8 + row * high
            if back != "#1e1e1e":
                parts.append(f'<rect x="{x:.1f}" y="{y}" width="{len(text) * wide:.1f}" height="{high}" fill="{back}"/>')
            if text.strip():
                bold = ' font-weight="bold"' if cell.bold else ""
                parts.append(f'<text x="{x:.1f}" y="{y + 14}" fill="{fore}"{bold} xml:space="preserve" '
                             f'textLength="{len(text) * wide:.1f}">{escape(text)}</text>')
    return "\n".join([*parts, "</svg>"]) + "\n"


if __name__ == "__main__":
    main()
