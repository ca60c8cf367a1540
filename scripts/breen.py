#!/usr/bin/python3
"""Simulates Breen's cloths on the cube with several seeds and counts what stands off at its corners.

    breen.py [FOLDER] [SEEDS]      default: build/breen, 5; 3 minutes, what is there is not done again

A line for each cloth: corners with two or more billows that stand out by 2, 3, 4, 5 and 6 cm in the cut
20 cm below the top; the mean of the largest at each; how skew the corners are, and on the same side.
"""
import json
import os
import subprocess
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
TOILE = os.path.join(ROOT, "scripts", "toile")
PROMINENCES = (0.02, 0.03, 0.04, 0.05, 0.06)  # [m]


def simulate(cloth, seed, folder):
    """The folder of a finished run."""
    os.makedirs(folder, exist_ok=True)
    run = os.path.join(folder, f"{cloth}-{seed}.run")
    scene = os.path.join(ROOT, "assets", "scenes", f"breen-{cloth}.yaml")
    subprocess.run([TOILE, "sim", scene, "-o", run, "--seed", str(seed), "--quiet"], check=True)
    return run


def measure(run):
    found = subprocess.run([TOILE, "measure", run, "--json", "--cut", "20cm", "--prominence", "1cm"],
                           check=True, capture_output=True, text=True)
    return json.loads(found.stdout)


def corners(drape):
    """The (distance, prominence) of the billows of each corner; the weft is a right angle from the warp."""
    at = [[], [], [], []]
    for angle, off, prominence in zip(drape["billow_angles_deg"], drape["billow_distances_m"],
                                      drape["billow_prominences_m"]):
        at[int(angle % 360 // 90)].append((off, prominence))
    return at


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "build", "breen")
    seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 5
    for cloth in ("cotton", "wool", "polycotton"):
        drapes = [measure(simulate(cloth, seed, folder)) for seed in range(1, seeds + 1)]
        every = [corner for drape in drapes for corner in corners(drape)]
        double = [sum(sum(p > least for _, p in corner) >= 2 for corner in every) for least in PROMINENCES]
        largest = [max(off for off, _ in corner) for corner in every if corner]
        skews = [skew for drape in drapes for skew in drape["corner_skews"] if skew is not None]
        common = [drape["corner_skew_common"] for drape in drapes]
        print(f"{cloth:11s} {'/'.join(map(str, double))} of {len(every)}; largest "
              f"{100 * sum(largest) / len(largest):.1f} cm; skew {100 * sum(skews) / len(skews):.0f} %, "
              f"common {100 * sum(common) / len(common):.0f} %")


if __name__ == "__main__":
    main()
