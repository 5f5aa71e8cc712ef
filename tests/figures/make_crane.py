"""Draw `crane.png`, the book's figure of a crane on outriggers of which one sinks.

    python -m venv .venv && .venv/bin/pip install polars matplotlib
    tipwatch analyze tests/data/crane.mcap --machine tests/data/crane.toml --out OUT
    .venv/bin/python make_crane.py OUT/samples.parquet tests/data/crane.truth.parquet crane.png
"""
import sys

import matplotlib

matplotlib.use("agg")
import matplotlib.pyplot as plt
import polars as pl

# Okabe and Ito: distinguishable with colour blindness, and by lightness in print
COLOURS = {"fl": "#0072B2", "fr": "#56B4E9", "rl": "#E69F00", "rr": "#D55E00"}


def main(samples_path, truth_path, out_path):
    rows, truth = pl.read_parquet(samples_path), pl.read_parquet(truth_path)
    start = rows["time_ns"][0]
    t = (rows["time_ns"].to_numpy() - start) * 1e-9
    true_t = (truth["t_ns"].to_numpy() - start) * 1e-9
    figure, axes = plt.subplots(2, 1, figsize=(8, 6), sharex=True, constrained_layout=True)
    for axis, prefix, title in ((axes[0], "", "wheels"), (axes[1], "o", "outriggers")):
        for corner, colour in COLOURS.items():
            name = f"{prefix}{corner}"
            axis.plot(true_t, truth[f"load_{name}"].to_numpy() / 1e3, color=colour, linestyle=":", linewidth=1)
            axis.plot(t, rows[f"load_{name}"].to_numpy() / 1e3, color=colour, label=name.upper())
        unknown = [not valid for valid in rows["valid"]]
        axis.fill_between(t, 0, 1, where=unknown, transform=axis.get_xaxis_transform(), color="0.85", linewidth=0)
        axis.set_ylabel(f"load of the {title} [kN]")
        axis.legend(ncols=4, fontsize="small", loc="upper center")
        axis.set_ylim(-3, 80)
    axes[1].set_xlabel("time [s]; lines: computed, dotted: contact forces of the simulation, grey: unknown")
    figure.savefig(out_path, dpi=110)


if __name__ == "__main__":
    main(*sys.argv[1:])
