#!/usr/bin/python3
"""Plots run time against error from results.csv: cantilever and swing, and the master curve of
the cantilever by all models; each as .png and .svg."""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def number(text):
    return float(text) if text else None


def plot(rows, key, title, path):
    """Run time against error, a line for each key."""
    groups = {}
    for row in rows:
        cpu, error = number(row["cpu_s"]), number(row["error"])
        if cpu and error:
            groups.setdefault(key(row), []).append((cpu, error))
    if not groups:
        return
    figure, axes = plt.subplots(figsize=(7, 5))
    for name in sorted(groups):
        points = sorted(groups[name])
        axes.loglog([p[0] for p in points], [p[1] for p in points], "o-", label=name)
    axes.set_xlabel("CPU time [s]")
    axes.set_ylabel("error / L")
    axes.set_title(title)
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7)
    figure.tight_layout()
    for ending in ("png", "svg"):
        figure.savefig(f"{path}.{ending}")


def plot_master(rows, path):
    """Drop over reach of the heavy strip against its load, all models and the exact curve."""
    if not rows:
        return
    groups, exact = {}, {}
    for row in rows:
        form, gamma = row["case"].split(" gamma=")
        groups.setdefault(f"{row['model']} {form}", []).append((float(gamma), number(row["value"])))
        exact[float(gamma)] = number(row["reference"])
    figure, axes = plt.subplots(figsize=(7, 5))
    axes.loglog(sorted(exact), [exact[g] for g in sorted(exact)], "k-", linewidth=2, label="exact")
    for index, name in enumerate(groups):
        points = sorted(groups[name])
        axes.loglog([p[0] for p in points], [p[1] for p in points], "ox+sd^v<>*p"[index % 11],
                    label=name, markersize=5, fillstyle="none")
    axes.set_xlabel("rho g L^3 / B")
    axes.set_ylabel("drop / reach")
    axes.set_title("cantilever under its own weight, 20 segments")
    axes.grid(True, which="both", alpha=0.3)
    axes.legend(fontsize=7)
    figure.tight_layout()
    for ending in ("png", "svg"):
        figure.savefig(f"{path}.{ending}")


def main():
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    folder = sys.argv[2]
    suite = lambda name: [r for r in rows if r["suite"] == name and r["case"] != "reference"]
    plot(suite("cantilever"), lambda r: r["case"] + " " + r["note"].split(";")[0],
         "cantilever: tip error", folder + "/cantilever")
    plot_master(suite("master"), folder + "/master")
    plot(suite("swing"),
         lambda r: r["model"] + " " + r["stepper"]
         + ("" if "courant" in r["note"] else " " + r["note"].split(";")[0]),
         "swing: rms error in time, n = 26", folder + "/swing")


if __name__ == "__main__":
    main()
