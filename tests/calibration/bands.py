"""Errors of the loads and whether their bands hold, for sensors of other noise than the defaults of the machine file.

    .venv/bin/python bands.py LAB LOGS/SET/LOG... --program target/release/tipwatch [--scales 0.2 1 5] [--seeds 1 2] [--fitting]

Each log is run with the laboratory's noise times each scale, causal and smoothed. The machine file knows the machine exactly, as the simulation does,
so that the bands are those of noise, of the sensors' constant errors and of `model_share`. `--fitting` adds the noise that is true for each scale, and
the agility that gives the least error of the causal loads among some (so it is chosen on what it is judged by), without corrections from the log.
Printed are the root mean square error and the mean standard deviation of a wheel's load [N], at rest and in motion, and the share within two of them.
"""
import argparse
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
EXACT = """
[uncertainty]
mass_share = 0.0
com = 0.0
inertia_share = 0.0
payload_mass_share = 0.0
wheel_position = 0.0
wheel_radius = 0.0
arm_position = 0.0
joint_offset = 0.0
joint_offset_linear = 0.0
imu_position = 0.0
imu_rotation = 0.0
gravity = 0.0
roll_moment_distribution = 0.0
tyre_stiffness_share = 0.0
"""
MOVING = 0.05    # rad/s or m/s of any joint
AGILITIES = (0.1, 0.5, 2.0, 10.0, 50.0)


def fitting(scale, agility):
    """Noise of the laboratory's sensors, as it is."""
    from noise import NOISE as n
    return (f"\n[estimator]\nnoise_from_log = false\njoint_position_noise = {scale * n['position'] + 3e-5}\njoint_rate_noise = {scale * n['velocity']}\n"
            f"joint_agility = {agility}\ngyro_noise = {scale * n['gyro']}\ngyro_agility = {20 * agility}\naccelerometer_noise = {scale * n['accelerometer']}\n"
            f"accelerometer_agility = {300 * agility}\nattitude_noise = {scale * n['attitude']}\nodometry_noise = {scale * n['odometry']}\n")


def run(program, log, machine, out, estimator):
    done = subprocess.run([program, "analyze", log, "--machine", machine, "--out", out, "--estimator", estimator, "--quiet"], capture_output=True, text=True)
    assert done.returncode in (0, 3, 4, 8), done.stderr


def figures(out, folder, log):
    """Errors, standard deviations and whether a row moves, by row and wheel, of valid rows whose wheels are on the ground."""
    import polars
    rows = polars.read_parquet(out / "samples.parquet")
    truth = polars.read_parquet(folder / "truth.parquet")
    wheels = [name for name in truth.columns if name.startswith("load_")]
    t, at = truth["t_ns"].to_numpy(), rows["time_ns"].to_numpy()
    _, velocity = log.both()
    joints = [k for k, name in enumerate(log.names()) if not name.startswith("wheel")]
    times = log.streams["/joint_states"].t
    import writelog
    speed = np.interp((at - writelog.T0) * 1e-9, times, np.abs(velocity[:, joints]).max(axis=1))
    true = np.stack([np.interp(at, t, truth[wheel].to_numpy()) for wheel in wheels], 1)
    found = np.stack([rows[wheel].to_numpy() for wheel in wheels], 1)
    sigma = np.stack([rows[f"{wheel}_sigma"].to_numpy() for wheel in wheels], 1)
    kept = rows["valid"].to_numpy() & (true > 0.02 * true.mean()).all(axis=1) & np.isfinite(sigma).all(axis=1)
    return (found - true)[kept], sigma[kept], speed[kept] > MOVING


def summary(error, sigma, moves):
    rms = lambda part: float(np.sqrt((part**2).mean())) if part.size else float("nan")
    inside = lambda part: 100 * float((np.abs(error[part]) < 2 * sigma[part]).mean()) if part.any() else float("nan")
    mean = lambda part: float(sigma[part].mean()) if part.any() else float("nan")
    rest = ~moves
    return (f"rms {rms(error):8.2f} (rest {rms(error[rest]):8.2f}, motion {rms(error[moves]):8.2f})   sigma rest {mean(rest):8.2f}, motion {mean(moves):8.2f}   "
            f"inside two sigma {100 * float((np.abs(error) < 2 * sigma).mean()):5.1f} % (rest {inside(rest):5.1f}, motion {inside(moves):5.1f})   rows {len(error)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("lab", type=Path)
    parser.add_argument("logs", type=Path, nargs="+")
    parser.add_argument("--program", required=True)
    parser.add_argument("--scales", type=float, nargs="+", default=[0.2, 1.0, 5.0])
    parser.add_argument("--seeds", type=int, nargs="+", default=[1])
    parser.add_argument("--fitting", action="store_true")
    arguments = parser.parse_args()
    sys.path[:0] = [str(arguments.lab), str(HERE)]
    from variants import Log, noise
    for folder in arguments.logs:
        clean = Log(folder)
        text = (folder / "machine.toml").read_text().replace('urdf = "machine.urdf"', f'urdf = "{folder.resolve() / "machine.urdf"}"') + EXACT
        for scale in arguments.scales:
            with tempfile.TemporaryDirectory() as place:
                place = Path(place)
                settings = {"defaults": "", "as stated": "\n[estimator]\nnoise_from_log = false\n"}
                if arguments.fitting:
                    settings |= {f"fitting, agility {agility}": fitting(scale, agility) for agility in AGILITIES}
                results = {}
                for seed in arguments.seeds:
                    log = clean.copy()
                    noise(log, seed, scale)
                    log.write(place / "log.mcap")
                    for name, more in settings.items():
                        (place / "machine.toml").write_text(text + more)
                        for estimator in ("causal", "smoother") if not name.startswith("fitting") else ("causal",):
                            run(arguments.program, place / "log.mcap", place / "machine.toml", place / "out", estimator)
                            results.setdefault((estimator, name), []).append(figures(place / "out", folder, clean))
                print(f"{folder.name}, noise times {scale}")
                for (estimator, name), parts in results.items():
                    print(f"  {estimator:8s} {name:20s} {summary(*(np.concatenate(part) for part in zip(*parts)))}", flush=True)


if __name__ == "__main__":
    main()
