"""Draw `second_paper.png`, the book's figure after Figs. 5 and 6 of the second paper.

    python -m venv .venv && .venv/bin/pip install polars matplotlib
    for MODEL in closed-form variable-inertia whole-body: tipwatch analyze tests/data/second_paper.mcap --machine MACHINE --model MODEL --out OUT/MODEL
    .venv/bin/python make_second_paper.py OUT tests/data/second_paper.truth.parquet second_paper.png

MACHINE is tests/data/second_paper.toml with ground = "plane" in [contact].
"""
import sys
from pathlib import Path

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import numpy as np
import polars as pl

# Okabe and Ito: distinguishable with colour blindness, and by lightness in print
MODELS = {"closed-form": ("#E69F00", "inertia frozen"), "variable-inertia": ("#56B4E9", "inertia from the actuators"), "whole-body": ("#0072B2", "whole body")}
WHEELS = ("fl", "fr", "rl", "rr")


def main(out, truth_path, picture):
    truth = pl.read_parquet(truth_path)
    start = truth["t_ns"][0]
    true_t = (truth["t_ns"].to_numpy() - start) * 1e-9
    figure, ((loads, rear), (errors, table)) = plt.subplots(2, 2, figsize=(10, 6), constrained_layout=True)
    for axes, wheel in ((loads, "fl"), (rear, "rl")):
        axes.plot(true_t, truth[f"load_{wheel}"].to_numpy() / 1e3, color="black", linewidth=2.5, alpha=0.4, label="true")
        axes.set_title(f"load {wheel.upper()}", fontsize=10)
    shares = {}
    for model, (colour, label) in MODELS.items():
        rows = pl.read_parquet(Path(out) / model / "samples.parquet")
        t = (rows["time_ns"].to_numpy() - start) * 1e-9
        inside = (t > true_t[0] + 0.5) & (t < true_t[-1] - 0.5)
        for axes, wheel in ((loads, "fl"), (rear, "rl")):
            axes.plot(t[inside], rows[f"otf_{wheel}"].to_numpy()[inside] / 1e3, color=colour, linewidth=1, label=label)
        shares[model] = []
        for wheel in WHEELS:
            true = np.interp(t[inside], true_t, truth[f"load_{wheel}"].to_numpy().astype(float))
            error = rows[f"otf_{wheel}"].to_numpy()[inside] - true
            shares[model].append(100 * np.sqrt(np.mean(error**2)) / true.mean())
            if wheel == "fl":
                errors.plot(t[inside], np.abs(error) / 1e3, color=colour, label=label)
    for i, (model, (colour, label)) in enumerate(MODELS.items()):
        bars = table.bar(np.arange(4) + 0.27 * (i - 1), shares[model], width=0.25, color=colour, label=label)
        table.bar_label(bars, fmt="%.1f", fontsize=7)
    errors.set_title("absolute error FL", fontsize=10)
    table.set_title("root mean square error, % of the wheel's mean load", fontsize=10)
    table.set_xticks(range(4), [wheel.upper() for wheel in WHEELS])
    for axes in (loads, rear, errors):
        axes.set_ylabel("kN")
        axes.set_xlabel("s")
        axes.grid(alpha=0.3)
    rear.legend(fontsize=8, loc=(0.24, 0.6))
    table.legend(fontsize=8)
    figure.savefig(picture, dpi=90)


main(*sys.argv[1:])
