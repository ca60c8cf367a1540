#!/usr/bin/python3
"""Draws what a virtual tester found beside what the fabric says.

    toile test NAME FABRIC -o FILE.png|svg|pdf [--model NAME] [--json]

The rows, or with --json the numbers, go to stdout as without -o."""
import csv
import io
import os
import subprocess
import sys

SIM = os.path.join(os.environ.get("TOILE_BUILD", os.path.join(os.path.dirname(__file__), "..", "build",
                                                              "release")), "toile-sim")
ENDINGS = (".png", ".svg", ".pdf")
SLOPE = 0.8847 # tan 41.5 degrees: the plane of ASTM D1388


def fail(code, text):
    print(f"toile: {text}", file=sys.stderr)
    sys.exit(code)


def take_output(arguments):
    """The file of -o, and the other arguments."""
    path, rest = None, []
    words = iter(arguments)
    for word in words:
        if word in ("-o", "--output"):
            path = next(words, "")
        elif word.startswith("--output="):
            path = word[len("--output="):]
        elif word.startswith("-o"):
            path = word[2:]
        else:
            rest.append(word)
    return path, rest


def ask(arguments):
    done = subprocess.run([SIM, "test", *arguments], stdout=subprocess.PIPE, text=True)
    if done.returncode:
        sys.exit(done.returncode)
    return done.stdout


def read_rows(text):
    """{direction: rows}, columns; one direction "" where the test has one only."""
    table = list(csv.reader(io.StringIO(text)))
    first = 1 if table[0][0] == "direction" else 0
    groups = {}
    for row in table[1:]:
        groups.setdefault(row[0] if first else "", []).append([float(word) for word in row[first:]])
    return groups, table[0][first:]


def draw_forces(axes, groups, columns):
    """What was measured, and in black what the fabric says: first column against second and last."""
    for name, rows in groups.items():
        at, force, fabric = ([row[k] for row in rows] for k in (0, 1, -1))
        line, = axes.plot(at, force, linewidth=2.5, label=f"tester {name}".strip())
        axes.plot(at, fabric, "k--", linewidth=1, label=f"fabric {name}".strip())
    axes.set_xlabel(columns[0])
    axes.set_ylabel(columns[1])


def draw_strips(axes, groups):
    """Strips from the side, in mm, on the plane that their tips have met."""
    longest = 0.0
    for name, rows in groups.items():
        reach, drop, fabric_reach, fabric_drop = ([1e3 * row[k] for row in rows] for k in range(1, 5))
        axes.plot(reach, [-z for z in drop], linewidth=2.5, label=f"tester {name}")
        axes.plot(fabric_reach, [-z for z in fabric_drop], "k--", linewidth=1, label=f"elastica {name}")
        longest = max(longest, reach[-1])
    axes.plot([0, 1.1 * longest], [0, -1.1 * longest * SLOPE], color="0.6", label="41.5 degrees")
    axes.set_aspect("equal")
    axes.set_xlabel("reach [mm]")
    axes.set_ylabel("height [mm]")


def main():
    path, arguments = take_output(sys.argv[1:])
    if os.path.splitext(path or "")[1] not in ENDINGS:
        fail(2, f"-o {path or ''}: a plot is a file that ends with {', '.join(ENDINGS)}")
    try:
        import matplotlib
    except ImportError as error:
        fail(66, f"{error}; plots need python3-matplotlib (scripts/setup.sh)")
    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    text = ask([word for word in arguments if word != "--json"])
    groups, columns = read_rows(text)
    figure, axes = plt.subplots(figsize=(7, 5))
    words = [word for word in arguments if word != "--json"]
    if columns[0] == "along [m]":
        draw_strips(axes, groups)
    else:
        draw_forces(axes, groups, columns)
    axes.set_title(" ".join(words))
    axes.grid(True, alpha=0.3)
    axes.legend(fontsize=8)
    figure.tight_layout()
    base, ending = os.path.splitext(path)
    part = base + ".part" + ending
    try:
        figure.savefig(part)
        os.replace(part, path)
    except OSError as error:
        if os.path.exists(part):
            os.unlink(part)
        fail(74, f"cannot write {path}: {error.strerror}")
    sys.stdout.write(ask(arguments) if "--json" in arguments else text)


if __name__ == "__main__":
    main()
