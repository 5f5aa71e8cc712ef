"""Draw `swing_lift.png`, the book's figure after Figs. 10 and 11 of the first paper.

    python -m venv .venv && .venv/bin/pip install polars matplotlib
    tipwatch analyze tests/data/swing_lift.mcap --machine tests/data/swing_lift.toml --out OUT
    .venv/bin/python make_swing_lift.py OUT/samples.parquet tests/data/swing_lift.truth.parquet swing_lift.png
"""
import sys

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
import polars as pl

# Okabe and Ito: distinguishable with colour blindness, and by lightness in print
COLOURS = {"fl": "#0072B2", "fr": "#56B4E9", "rl": "#E69F00", "rr": "#D55E00"}
EDGES = {"front": "#0072B2", "left": "#D55E00", "rear": "#E69F00", "right": "#56B4E9"}


def smoothed(values, half=25):
    """Third-order Savitzky-Golay smoothing over 51 samples, as in the tests."""
    k = np.arange(-half, half + 1)
    scale = (2 * half - 1) * (2 * half + 1) * (2 * half + 3) / 3
    weights = (3 * half * half + 3 * half - 1 - 5 * k * k) / scale
    return np.convolve(values, weights, "same")


def main(samples_path, truth_path, out_path):
    rows = pl.read_parquet(samples_path)
    truth = pl.read_parquet(truth_path)
    start = rows["time_ns"][0]
    t = (rows["time_ns"].to_numpy() - start) * 1e-9
    true_t = (truth["t_ns"].to_numpy() - start) * 1e-9
    figure, (loads, moments) = plt.subplots(2, 1, figsize=(8, 6), sharex=True, constrained_layout=True)
    for wheel, colour in COLOURS.items():
        otf = rows[f"otf_{wheel}"].to_numpy() / 1e3
        sigma = rows[f"otf_{wheel}_sigma"].to_numpy() / 1e3
        loads.fill_between(t, otf - 2 * sigma, otf + 2 * sigma, color=colour, alpha=0.18, linewidth=0)
        loads.plot(t, otf, color=colour, label=f"OTF {wheel.upper()}")
    true = smoothed(truth["load_rr"].to_numpy().astype(float)) / 1e3
    inside = (true_t > 0.1) & (true_t < t[-1] - 0.1)
    loads.plot(true_t[inside][::25], true[inside][::25], "k.", markersize=3, label="true load RR")
    loads.axhline(0, color="black", linewidth=0.8)
    loads.set_ylabel("kN")
    loads.set_title("The arm is swung over the front left wheel: OTF sees the rear right wheel lift", fontsize=10)
    loads.legend(loc="upper right", fontsize=8, ncols=3)
    for edge, colour in EDGES.items():
        moments.plot(t, rows[f"itom_{edge}"].to_numpy() / 1e3, color=colour, label=f"ITOM {edge}")
    moments.axhline(0, color="black", linewidth=0.8)
    moments.set_ylabel("kN m (negative = stable)")
    moments.set_xlabel("s")
    moments.set_title("no overturning moment comes near zero", fontsize=10)
    moments.legend(loc="lower right", fontsize=8, ncols=2)
    for axes in (loads, moments):
        axes.grid(alpha=0.3)
    figure.savefig(out_path, dpi=100)


main(*sys.argv[1:])
