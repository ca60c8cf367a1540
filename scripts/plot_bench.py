#!/usr/bin/env python3
"""Plots run time against error from results.csv: cantilever.png/.svg and swing.png/.svg."""
import csv
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt


def number(text):
    return float(text) if text else None


def plot(rows, key, title, path):
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


def main():
    with open(sys.argv[1], newline="") as file:
        rows = list(csv.DictReader(file))
    folder = sys.argv[2]
    suite = lambda name: [r for r in rows if r["suite"] == name and r["case"] != "reference"]
    plot(suite("cantilever"), lambda r: r["case"] + " " + r["note"].split(";")[0],
         "cantilever: tip error", folder + "/cantilever")
    plot(suite("swing"),
         lambda r: r["stepper"] + ("" if r["stepper"] == "central" else " " + r["note"].split(";")[0]),
         "swing: rms error in time, n = 26", folder + "/swing")


main()
