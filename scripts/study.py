#!/usr/bin/python3
"""Run time against error on your own scene: models, nodes, steppers and steps side by side.

    toile study SCENE [-o FOLDER] [options]

Every combination is a run of its own in FOLDER; those that are there already are not done again. The
error is the root mean square of distances over all nodes and frames, divided by the size of the cloth,
against the finest run of the scene's own model: most nodes, first stepper, smallest step. Where a scene
has a `reference`, a list of exact places, it is the distance to those in the last frame.

Writes FOLDER/study.csv (the columns of make bench), study.png and study.svg; prints a table."""
import argparse
import concurrent.futures
import csv
import itertools
import json
import os
import signal
import subprocess
import sys

try:
    import matplotlib
    import numpy as np
except ImportError as error:
    sys.exit(f"study: {error}; python3-numpy and python3-matplotlib are needed (scripts/setup.sh)")

import read_states

matplotlib.use("Agg")

SIM = os.path.join(os.environ.get("TOILE_BUILD", os.path.join(os.path.dirname(__file__), "..", "build",
                                                              "release")), "toile-sim")
COLUMNS = ("suite,case,model,stepper,nodes,dt,quantity,value,reference,error,cpu_s,note").split(",")
running, stopped = set(), False


def fail(code, text):
    print(f"study: {text}", file=sys.stderr)
    sys.exit(code)


# ---- the runs ----

def check(path, *options):
    """The plan of a scene, or an exit with its message."""
    done = subprocess.run([SIM, "check", path, "--json", *options], capture_output=True, text=True)
    if done.returncode:
        sys.stderr.write(done.stderr)
        sys.exit(done.returncode)
    sys.stderr.write(done.stderr)
    return json.loads(done.stdout)


def lattice(cloth, factor):
    """u x v with that many times the edges: the nodes of factor 1 are among those of factor 2."""
    u, v = cloth["lattice"]
    u = round(u * factor) if cloth["wraps"] else round((u - 1) * factor) + 1
    return max(u, 3), max(round((v - 1) * factor) + 1, 3)


def variant_text(scene, plan, model, factor, stepper, step):
    lines = ["toile: 1", f"include: {json.dumps(os.path.abspath(scene))}", "cloth:"]
    for cloth in plan["cloths"]:
        keys = [f"model: {model or cloth['model']}"]
        if factor != 1.0:
            keys.append("nodes: %d x %d" % lattice(cloth, factor))
        if model and model != cloth["model"]:
            keys.append("bending: auto")
        lines.append(f"  {cloth['name']}: {{{', '.join(keys)}}}")
    solver = [f"stepper: {stepper}"] if stepper else []
    solver += [f"step: {step}"] if step else []
    lines += [f"solver: {{{', '.join(solver)}}}"] if solver else []
    return "\n".join(lines) + "\n"


def plan_variants(arguments, plan, folder):
    """The scenes of all combinations, the finest one first."""
    variants = []
    models = arguments.models or [None]
    for model, factor, stepper, step in itertools.product(
            models, sorted(arguments.nodes, reverse=True), arguments.steppers or [None],
            arguments.steps or [None]):
        words = [model or plan["cloths"][0]["model"], f"n{factor:g}", stepper or plan["stepper"]]
        words += [step.replace("/", "-").replace(" ", "")] if step else []
        name = "_".join(words)
        text = variant_text(arguments.scene, plan, model, factor, stepper, step)
        path = os.path.join(folder, name + ".yaml")
        old = open(path).read() if os.path.exists(path) else None
        if old != text:
            with open(path, "w") as file:
                file.write(text)
        variants.append(dict(name=name, model=words[0], factor=factor, stepper=words[2], step=step or ""))
    return variants


def run(folder, name):
    """Simulates one variant, or goes on with it. What went wrong stands in NAME.log."""
    scene, out = (os.path.join(folder, name + end) for end in (".yaml", ".run"))
    for option in ("--resume", "--force"):
        if stopped:
            return
        child = subprocess.Popen([SIM, "sim", scene, "-o", out, option, "--threads", "1", "--quiet"],
                                 stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)
        running.add(child)
        message = child.communicate()[1]
        running.discard(child)
        with open(os.path.join(folder, name + ".log"), "w") as file:
            file.write(message if child.returncode else "")
        if "--force starts it anew" not in message:
            return


def stop(*_):
    global stopped
    stopped = True
    for child in list(running):
        child.send_signal(signal.SIGINT)


def run_all(folder, variants, jobs):
    signal.signal(signal.SIGINT, stop)
    signal.signal(signal.SIGTERM, stop)
    with concurrent.futures.ThreadPoolExecutor(jobs) as pool:
        work = {pool.submit(run, folder, v["name"]): v["name"] for v in variants}
        for count, done in enumerate(concurrent.futures.as_completed(work), 1):
            if not stopped:
                print(f"study: {count} of {len(variants)}: {work[done]}", file=sys.stderr)
    if stopped:
        fail(130, f"stopped; the same command goes on with {folder}")


# ---- the errors ----

class Cloth:
    """One cloth of a run, as functions of its place (u, v)."""

    def __init__(self, layout, index):
        self.u, self.v, self.wraps, _ = (int(n) for n in layout.lattice[index])
        self.vertices = slice(*layout.vertex_begin[index:index + 2])
        self.places = layout.vertex_material[self.vertices]
        self.triangles = (layout.triangles[slice(*layout.triangle_begin[index:index + 2])]
                          - layout.vertex_begin[index])
        self.finder = None

    def size(self):
        return float(np.ptp(self.places, axis=0).max())

    def weights(self, points):
        """Vertices (n, 3 or 4) and their shares of each point; NaN where no cloth is."""
        return self.on_lattice(points) if self.u else self.on_triangles(points)

    def on_lattice(self, points):
        grid = self.places.reshape(self.v, self.u, 2)
        spacing = np.array([grid[0, 1, 0] - grid[0, 0, 0], grid[1, 0, 1] - grid[0, 0, 1]])
        at = (points - grid[0, 0]) / spacing
        most = [self.u if self.wraps else self.u - 2, self.v - 2]
        cell = np.clip(np.floor(at + 1e-9).astype(int), 0, most)
        part = at - cell
        right, above = (cell[:, 0] + 1) % self.u, cell[:, 1] + 1
        left = cell[:, 0] % self.u
        nodes = np.stack([cell[:, 1] * self.u + left, cell[:, 1] * self.u + right,
                          above * self.u + left, above * self.u + right], axis=1)
        p, q = part[:, 0], part[:, 1]
        return nodes, np.stack([(1 - p) * (1 - q), p * (1 - q), (1 - p) * q, p * q], axis=1)

    def on_triangles(self, points):
        from matplotlib.tri import Triangulation
        if self.finder is None:
            self.finder = Triangulation(*self.places.T, self.triangles).get_trifinder()
        found = self.finder(*points.T)
        nodes = self.triangles[found]
        a, b, c = (self.places[nodes[:, k]] for k in range(3))
        cross = lambda p, q: p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        area = cross(b - a, c - a)
        p, q = cross(points - a, c - a) / area, cross(b - a, points - a) / area
        shares = np.stack([1 - p - q, p, q], axis=1)
        shares[found < 0] = np.nan # outlines of polygons differ a little
        return nodes, shares


def cloths_of(states):
    return [Cloth(states.layouts[0], i) for i in range(len(states.header.cloths))]


def rms_error(states, finest):
    """Over all nodes and frames / size, against the finest run at the same points of the cloth."""
    total, count, size = 0.0, 0, 0.0
    for mine, its in zip(cloths_of(states), cloths_of(finest)):
        nodes, shares = its.weights(mine.places)
        size = max(size, its.size())
        for frame, other in zip(states.frames[1:], finest.frames[1:]):
            x = frame.layout.surface(frame["x"])[mine.vertices]
            y = other.layout.surface(other["x"])[its.vertices]
            square = ((x - np.einsum("nk,nkc->nc", shares, y[nodes])) ** 2).sum(axis=1)
            total += np.nansum(square)
            count += np.count_nonzero(np.isfinite(square))
    return np.sqrt(total / max(count, 1)) / size


def point_error(states, reference):
    """Root mean square distance of the points of `reference` in the last frame / size."""
    cloths, squares, size = cloths_of(states), [], 0.0
    surface = states.frames[-1].layout.surface(states.frames[-1]["x"])
    for point in reference:
        cloth = cloths[point["cloth"]]
        nodes, shares = cloth.weights(np.array([point["at"]]))
        place = shares[0] @ surface[cloth.vertices][nodes[0]]
        squares.append(((place - point["is"]) ** 2).sum())
        size = max(size, cloth.size())
    return np.sqrt(np.mean(squares)) / size


def load(folder, variant):
    """The run of a variant, or None and the reason in variant["note"]."""
    try:
        states = read_states.States(os.path.join(folder, variant["name"] + ".run"))
    except (OSError, read_states.Damage) as error:
        states = None
        variant["note"] = str(error)
    with open(os.path.join(folder, variant["name"] + ".log")) as file:
        message = [line for line in file.read().splitlines() if line.strip()]
    if message:
        variant["note"] = message[0].split(" error: ")[-1].replace(",", ";")
        return None
    return states


def measure(folder, variants, plan):
    """Fills nodes, dt, cpu and error of all variants that ran to their end."""
    finest = None
    own = plan["cloths"][0]["model"]
    for variant in sorted(variants, key=lambda v: v["model"] != own):
        variant["note"] = ""
        states = load(folder, variant)
        if states is None:
            continue
        steps = [f.statistics.get("step_length", 0.0) for f in states.frames]
        variant.update(nodes=states.layouts[0].node_count, dt=float(np.median(steps[1:])),
                       cpu=sum(f.statistics.get("cpu", 0.0) for f in states.frames))
        if plan["reference"]:
            variant["error"] = point_error(states, plan["reference"])
        elif finest is None:
            finest = states
            variant["note"] = "the reference"
        elif len(states.frames) == len(finest.frames):
            variant["error"] = rms_error(states, finest)


# ---- what is shown ----

def row_of(variant, plan):
    number = lambda key: f"{variant[key]:.9g}" if key in variant else ""
    quantity = "points / L" if plan["reference"] else "rms / L"
    return dict(zip(COLUMNS, ("study", plan["scene"], variant["model"], variant["stepper"],
                              number("nodes"), number("dt"), quantity, number("error"), "0",
                              number("error"), number("cpu"), variant["note"])))


def show(variants):
    print(f"{'model':<12}{'stepper':<18}{'nodes':>7}{'step [ms]':>11}{'CPU [s]':>9}{'error %':>10}  note")
    for v in sorted(variants, key=lambda v: v.get("cpu", np.inf)):
        text = lambda key, form, scale=1.0: form % (scale * v[key]) if key in v else ""
        print(f"{v['model']:<12}{v['stepper']:<18}{text('nodes', '%d'):>7}"
              f"{text('dt', '%.3g', 1e3):>11}{text('cpu', '%.3g'):>9}"
              f"{text('error', '%.3g', 100.0):>10}  {v['note'][:70]}")


def write(folder, variants, plan):
    rows = [row_of(v, plan) for v in variants]
    with open(os.path.join(folder, "study.csv"), "w", newline="") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    from plot_bench import plot
    plot(rows, lambda r: r["model"] + " " + r["stepper"], plan["scene"], os.path.join(folder, "study"))


def words(text):
    return [word.strip() for word in text.split(",") if word.strip()]


def factors(text):
    numbers = [float(word) for word in words(text)]
    if not numbers or min(numbers) <= 0.0 or max(numbers) > 100.0:
        raise argparse.ArgumentTypeError("wants factors such as 0.5,1,2")
    return numbers


def read_arguments():
    parser = argparse.ArgumentParser(prog="toile study", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scene")
    parser.add_argument("-o", "--output", metavar="FOLDER", help="default: SCENE.study")
    parser.add_argument("--models", type=words, metavar="A,B", help="default: the scene's own")
    parser.add_argument("--nodes", type=factors, default=[0.5, 0.7, 1.0], metavar="F,G",
                        help="factors on the edges along each side; default 0.5,0.7,1")
    parser.add_argument("--steppers", type=words, metavar="A,B", help="default: the scene's own")
    parser.add_argument("--steps", type=words, metavar="S,T", help="time steps: 1/60 s,1/120 s")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), metavar="N", help="runs at a time")
    parser.add_argument("--slurm", action="store_true", help="as an array of Slurm")
    return parser.parse_args()


def main():
    if sys.argv[1:2] == ["--run"]: # one task of an array
        return run(*sys.argv[2:4])
    arguments = read_arguments()
    plan = check(arguments.scene)
    if any(not cloth["lattice"][0] for cloth in plan["cloths"]) and arguments.nodes != [1.0]:
        fail(65, "factors of nodes are for lattices, and a cloth of this scene has none: --nodes 1")
    base = os.path.splitext(os.path.basename(arguments.scene))[0]
    folder = arguments.output or base + ".study"
    os.makedirs(folder, exist_ok=True)
    variants = plan_variants(arguments, plan, folder)
    if arguments.slurm:
        with open(os.path.join(folder, "runs"), "w") as file:
            file.writelines(v["name"] + "\n" for v in variants)
        here = os.path.dirname(os.path.abspath(__file__))
        if subprocess.run([os.path.join(here, "slurm_array.sh"), "study", folder]).returncode:
            fail(1, "the array failed")
    else:
        run_all(folder, variants, max(arguments.jobs, 1))
    measure(folder, variants, plan)
    show(variants)
    write(folder, variants, plan)
    print(f"study: {folder}/study.csv, study.png, study.svg", file=sys.stderr)
    return 0 if any("error" in v for v in variants) else 1


if __name__ == "__main__":
    sys.exit(main())
