#!/usr/bin/python3
"""Fuzzes whole scenes: draws them by lot, runs each, and judges what comes out.

    scenes.py [--first SEED] [--count N] [--cpu SECONDS] [-o FOLDER]

A seed is a scene, from the whole language, as a user might write it. Demanded of each:

    the run ends with 0; or with 65 and FILE:LINE:COLUMN: error: ..., and the same from `check`
    all frames are there, their numbers finite, and nothing crosses anything in any of them
    every third seed: the same bits with two threads and narrower vectors
    every third seed: the same bits after the run was killed and resumed

A run that needs more CPU time than allowed is stopped, and what it made is judged. Scenes that fail stay
in FOLDER. TOILE_BUILD names another build than build/release, as for the front. Needs no packages."""
import argparse
import json
import math
import os
import random
import re
import resource
import shutil
import signal
import subprocess
import sys
import time

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
BUILD = os.environ.get("TOILE_BUILD", os.path.join(ROOT, "build", "release"))
SIM, RENDER = (os.path.join(BUILD, name) for name in ("toile-sim", "toile-render"))

AXES = ("x", "y", "z", "-x", "-y", "-z", "[1, 1, 0]", "[0.3, -0.5, 1]")
EXPLICIT = ("auto", "auto", "auto", "central", "central", "symplectic_euler")
IMPLICIT = ("bdf2", "backward_euler", "static")
FREE = ("midpoint", "rk4", "rk45", "one_solve", "relaxation", "stochastic", "three_phase")  # without contact
WINDLESS = ("static", "relaxation", "stochastic", "three_phase")
LATTICES = ("rectangle", "sleeve")
KINDS = ("rectangle",) * 5 + ("scattered", "sleeve", "sleeve", "disc", "annulus", "polygon")
REGIONS = {
    "rectangle": ("left", "right", "top", "bottom", "top-left", "bottom-right", "midline", "border"),
    "scattered": ("left", "right", "top", "bottom", "border"),
    "sleeve": ("start", "end"),
    "disc": ("border",),
    "annulus": ("border", "inner"),
    "polygon": ("border",),
}
# a run may end before its time: cloth that pinches an obstacle for too long, a search for rest
STOPS = ("behind its motion", "equilibrium")
PLACED_ERROR = re.compile(r"^[^:\n]+:\d+:\d+: error: .", re.MULTILINE)


# ---- a scene by lot ----

def chance(lot, part):
    return lot.random() < part


def vector(lot, size, unit=""):
    return "[" + ", ".join(f"{lot.uniform(-size, size):.3f}{unit}" for _ in range(3)) + "]"


def place_at(lot, wide, height):
    return f"[{lot.uniform(-wide, wide):.3f} m, {lot.uniform(-wide, wide):.3f} m, {height:.4f} m]"


def turn(lot, most):
    return f"axis: {lot.choice(AXES)}, by: {lot.randint(-most, most)} deg"


def draw_motion(lot, begin):
    """One or two moves and turns of a hand, the first one from `begin` [s] on."""
    pieces = []
    for _ in range(lot.choice((1, 1, 2))):
        span = f"from: {begin:.2f} s, to: {begin + lot.choice((0.2, 0.4, 0.8)):.2f} s"
        if chance(lot, 0.5):
            pieces.append(f"{{move: {{by: {vector(lot, lot.choice((0.05, 0.1, 0.2)), ' m')}, {span}}}}}")
        else:
            pieces.append(f"{{turn: {{{turn(lot, 120)}, {span}}}}}")
        begin = lot.uniform(0, 0.6)
    return "[" + ", ".join(pieces) + "]"


def draw_shape(lot, kind, size, model):
    """`size` [m] is the largest extent, about."""
    if kind in ("rectangle", "scattered"):
        text = f"rectangle: {{width: {size:.3f} m, height: {size * lot.uniform(0.5, 1.3):.3f} m"
        text += ", rest_curvature: [%.1f, %.1f]" % (lot.uniform(-5, 5), 0) if chance(lot, 0.05) else ""
        return text + "}"
    if kind == "sleeve":
        rest = "flat" if model == "particles" else lot.choice(("flat", "curved"))
        return f"sleeve: {{radius: {size / 6:.3f} m, length: {size:.3f} m, rest: {rest}}}"
    if kind == "disc":
        return f"disc: {{radius: {size / 2:.3f} m}}"
    if kind == "annulus":
        return f"annulus: {{radius: {size / 2:.3f} m, inner: {size / 6:.3f} m}}"
    corners = ((0, 0), (1, 0), (0.9, 0.6), (0.4, 0.5), (0, 1))
    outline = ", ".join(f"[{u * size:.3f}, {v * size:.3f}]" for u, v in corners)
    hole = ", ".join(f"[{u * size:.3f}, {v * size:.3f}]" for u, v in ((0.2, 0.2), (0.5, 0.2), (0.3, 0.4)))
    return f"polygon: {{outline: [{outline}]" + (f", holes: [[{hole}]]" if chance(lot, 0.3) else "") + "}"


def draw_model(lot, kind):
    models = ["mlpg", "mlpg", "mlpg", "triangles"]
    models += ["springs", "particles"] if kind in LATTICES else []
    return lot.choice(models)


def draw_fabric(lot, name):
    if chance(lot, 0.4):
        folder = os.path.join(ROOT, "assets", "fabrics")
        return lot.choice(sorted(f[:-5] for f in os.listdir(folder) if f.endswith(".yaml")))
    return (f"{{name: {name}, weight: {lot.choice((50, 150, 300))} g/m2, "
            f"thickness: {lot.choice((0.2, 0.5, 1))} mm, isotropic: {{"
            f"stretch: {lot.choice((100, 300, 1000, 3000))} N/m, poisson: {lot.uniform(0, 0.4):.2f}, "
            f"bending: {lot.choice(('1e-6', '1e-5', '1e-4'))} N m}}}}")


def draw_nodes(lot, kind, size, most):
    along = lot.choice([n for n in (7, 9, 12, 15, 18, 22, 27) if n <= most])
    if kind == "rectangle":
        return [f"nodes: {along} x {max(5, int(along * lot.uniform(0.6, 1.2)))}"]
    if kind == "sleeve":
        return [f"nodes: {max(12, along)} x {along}"]
    lines = [f"spacing: {size / along:.4f} m"]
    if kind == "scattered":
        lines += ["scattered: true", f"jitter: {lot.uniform(0, 0.3):.2f}"]
    return lines


def draw_habits(lot, kind, model):
    """Keys of a cloth that may be left out."""
    lines = []
    if chance(lot, 0.3):
        lines.append(f"velocity: {vector(lot, lot.choice((1, 5, 20)), ' m/s')}")
    if chance(lot, 0.4):
        lines.append(f"noise: {lot.uniform(0.01, 1):.2f} mm")
    if chance(lot, 0.4):
        lines.append(f"damping: {lot.choice((0.2, 1, 8))} 1/s")
    if chance(lot, 0.1):
        lines.append(f"bending_damping: {lot.choice((0, 0.001, 0.05))} s")
    if chance(lot, 0.1):
        lines.append(f"membrane_damping: {lot.choice((0, 0.00001, 0.001))} s")
    if model == "mlpg" and kind == "rectangle" and chance(lot, 0.3):
        lines.append(f"sides: {lot.choice(('free', 'bounded'))}")
    elif model == "mlpg" and chance(lot, 0.2):
        lines.append("kinematics: corotational")
    if model in ("mlpg", "springs") and kind == "rectangle" and chance(lot, 0.1):
        lines.append("hysteresis: true")
    return lines


class Cloth:
    """A piece of cloth above `floor` [m]: its lines, what can be held, and its top [m]."""

    def __init__(self, lot, name, floor, most_nodes):
        kind = lot.choice(KINDS)
        self.name, self.regions, self.size = name, REGIONS[kind], lot.uniform(0.12, 0.5)
        model = draw_model(lot, kind)
        turned = chance(lot, 0.4)
        reach = 0.5 * self.size if kind == "sleeve" else 0
        if turned:  # as far as a corner may be from what it is turned about
            reach = self.size * (math.sqrt(2) if kind == "polygon" else 0.85)
        place = floor + reach + lot.choice((0.01, 0.03, 0.1))
        self.top = place + reach
        lines = [f"model: {model}", f"shape: {{{draw_shape(lot, kind, self.size, model)}}}",
                 f"fabric: {draw_fabric(lot, 'of-' + name)}"]
        lines += draw_nodes(lot, kind, self.size, most_nodes)
        lines.append(f"at: {place_at(lot, 0.05, place)}")
        lines += [f"turn: {{{turn(lot, 180)}}}"] if turned else []
        self.lines = lines + draw_habits(lot, kind, model)


def draw_held(lot, cloth):
    """What a handle holds, and how."""
    how = lot.random()
    region = f"{cloth.name}.{lot.choice(cloth.regions)}"
    if how < 0.1:
        return f"clamp: {region}"
    if how < 0.2:
        return f"hold: {cloth.name}, nearest: [{0.3 * cloth.size:.3f}, {0.3 * cloth.size:.3f}]"
    if how < 0.3:
        centre = 0.3 * cloth.size
        return (f"hold: {cloth.name}, circle: {{centre: [{centre:.3f} m, {centre:.3f} m], "
                f"radius: {0.2 * cloth.size:.3f} m}}")
    return f"hold: {region}"


def draw_handle(lot, cloth):
    text, begin = draw_held(lot, cloth), lot.uniform(0, 0.5)
    text += f", motion: {draw_motion(lot, begin)}" if chance(lot, 0.7) else ""
    if chance(lot, 0.3) and not text.startswith("clamp"):
        text += f", release: {lot.uniform(max(begin, 0.6) + 0.05, 1):.2f} s"
    return f"  - {{{text}}}"


def draw_solid(lot, r, meshes):
    """A solid of radius r [m], about."""
    kind = lot.choice(("sphere", "box", "box", "cylinder", "capsule", "cone", "mesh", "form"))
    if kind == "sphere":
        return f"sphere: {{radius: {r:.3f} m}}"
    if kind == "box":
        rounding = ", rounding: 5 mm" if r > 0.03 and chance(lot, 0.5) else ""
        wide, deep = (r * lot.uniform(0.5, 3) for _ in range(2))
        return f"box: {{size: [{wide:.3f} m, {deep:.3f} m, {1.6 * r:.3f} m]{rounding}}}"
    if kind == "mesh":
        name = lot.choice(("icosphere.obj", "l-shape.stl", "torus.ply"))
        return f"mesh: {{file: {meshes}/{name}, scale: {r:.3f} m}}"
    if kind == "form":
        return f"mesh: {{file: {meshes}/mannequin.glb, scale: {r:.3f} m}}"
    thin = {"cylinder": 0.5, "capsule": 0.4, "cone": 1}[kind]
    return f"{kind}: {{radius: {thin * r:.3f} m, length: {lot.uniform(1.2, 1.8) * r:.3f} m}}"


def draw_obstacle(lot, name, meshes):
    friction = f", friction: {lot.choice((0, 0.1, 0.3, 0.6, 1.5))}" if chance(lot, 0.8) else ""
    if chance(lot, 0.15):
        return f"  {name}: {{plane: {{}}, at: [0, 0, {-lot.uniform(0.05, 0.4):.3f} m]{friction}}}"
    r = lot.uniform(0.02, 0.12)
    solid = draw_solid(lot, r, meshes)
    form = "mannequin" in solid  # it stands on its origin
    below = (1.5 if form else 1) * r + lot.uniform(0, 0.15)
    text = f"{solid}, at: {place_at(lot, 0.15, -below)}"
    if chance(lot, 0.3) and not form:
        text += f", turn: {{axis: {lot.choice(AXES)}, by: {lot.randint(0, 90)} deg}}"
    if form and chance(lot, 0.5):
        text += ", motion: file"
    elif chance(lot, 0.4):
        text += f", motion: {draw_motion(lot, lot.uniform(0, 0.6))}"
    return f"  {name}: {{{text}{friction}}}"


def draw_solver(lot):
    """The stepper, and the line of the solver."""
    kind = lot.random()
    stepper = lot.choice(EXPLICIT if kind < 0.85 else IMPLICIT if kind < 0.95 else FREE)
    text = f"stepper: {stepper}"
    if stepper in FREE:
        text += ", self_contact: false"
    elif stepper in EXPLICIT and chance(lot, 0.12):
        text += ", contact: impulses"
    elif chance(lot, 0.05):
        text += ", contact_distance: 2 mm"
    return stepper, f"solver: {{{text}}}"


def draw_air(lot, wind):
    if wind and chance(lot, 0.3):
        return [f"air: {{density: 1.2 kg/m3, wind: {vector(lot, lot.choice((1, 8)), ' m/s')}}}"]
    if chance(lot, 0.3):
        return [f"air: {{drag: {lot.uniform(0, 0.2):.2f} kg/(m2 s)}}"]
    return []


def draw_scene(seed, meshes):
    """The text of a scene and its stepper; `meshes` is the way from the scene to assets/meshes."""
    lot = random.Random(seed)
    stepper, solver = draw_solver(lot)
    quick = stepper in EXPLICIT
    lines = ["toile: 1", "film: {rate: %d, seconds: %g}" % (
        lot.choice((24, 30, 30, 60)), lot.choice((0.8, 1.2, 1.5)) if quick else 0.3), "cloth:"]
    cloths, top = [], 0.02
    for c in range(lot.choice((1, 1, 1, 2, 2, 3)) if quick else 1):
        cloths.append(Cloth(lot, f"c{c}", top, 27 if quick else 9))
        top = cloths[-1].top
        lines += [f"  {cloths[-1].name}:"] + ["    " + line for line in cloths[-1].lines]
    handles = [draw_handle(lot, cloth) for cloth in cloths if chance(lot, 0.5)]
    lines += ["handles:"] + handles if handles else []
    count = 0 if stepper in FREE else lot.choice((0, 1, 1, 2, 2, 3))
    obstacles = [draw_obstacle(lot, f"o{o}", meshes) for o in range(count)]
    lines += ["obstacles:"] + obstacles if obstacles else []
    lines += draw_air(lot, stepper not in WINDLESS)
    lines += [f"gravity: {vector(lot, 10, ' m/s2')}"] if chance(lot, 0.1) else []
    return "\n".join(lines + [solver]) + "\n", stepper


# ---- what comes out ----

class Failure(Exception):
    """What a scene did that no scene may do."""


def need(condition, text):
    if not condition:
        raise Failure(text)


def last_words(text):
    """The last line of a message that speaks of an error, or the last one."""
    lines = text.strip().splitlines() or ["no message"]
    return ([line for line in lines if "error" in line.lower()] or lines)[-1][-300:]


class Trial:
    """The runs of one scene, in a folder of its own."""

    def __init__(self, seed, folder, cpu):
        self.seed, self.cpu = seed, cpu
        self.scene = os.path.join(folder, f"{seed}.yaml")
        self.runs = os.path.join(folder, f"{seed}.runs")
        os.makedirs(self.runs, exist_ok=True)
        meshes = os.path.relpath(os.path.join(ROOT, "assets", "meshes"), folder)
        text, self.stepper = draw_scene(seed, meshes)
        self.self_contact = "self_contact: false" not in text
        with open(self.scene, "w") as file:
            file.write(text)

    def path(self, name):
        return os.path.join(self.runs, name)

    def limit(self):
        resource.setrlimit(resource.RLIMIT_CPU, (self.cpu, self.cpu + 5))

    def command(self, name, *options):
        return [SIM, "sim", self.scene, "-o", self.path(name), "--quiet", *options]

    def start(self, *command, vectors=None):
        environment = dict(os.environ, TOILE_VECTORS=vectors) if vectors else None
        done = subprocess.run(command, capture_output=True, text=True, env=environment,
                              preexec_fn=self.limit)
        need("runtime error:" not in done.stderr and "Sanitizer" not in done.stderr,
             "sanitizer: " + last_words(done.stderr))
        return done

    def simulate(self, name, *options, vectors=None):
        done = self.start(*self.command(name, *options), vectors=vectors)
        need(done.returncode == 0,
             f"{' '.join(options)}: exit code {done.returncode}: {last_words(done.stderr)}")

    def judge_refusal(self, done):
        need(PLACED_ERROR.search(done.stderr), f"no place in the message: {last_words(done.stderr)}")
        check = self.start(SIM, "check", self.scene)
        need(check.returncode == 65,
             f"sim refuses, check ends with {check.returncode}: {last_words(done.stderr)}")

    def judge_frames(self, whole):
        """What crosses, or is no number: the reader refuses that."""
        if not os.path.exists(self.path("one/run.states")) and not whole:
            return
        done = self.start(RENDER, "measure", self.path("one"), "--crossings", "--json")
        need(done.returncode in (0, 1), f"measure: {last_words(done.stderr)}")
        found = json.loads(done.stdout)
        need(found["complete"] or not whole, f"only {found['frames_checked']} frames are there")
        need(found["crossings"] == 0 or not self.self_contact,
             f"{found['crossings']} crossings in {found['frames_crossing']} frames")

    def judge_same(self, name, how):
        done = self.start(RENDER, "diff", "--profile", "exact", "--quiet", self.path("one"), self.path(name))
        need(done.returncode == 0, f"other bits {how}: {last_words(done.stdout + done.stderr)}")

    def judge_threads(self):
        """Two threads, and vectors of another width than the processor would choose."""
        width = random.Random(self.seed).choice(("scalar", "sse2"))
        self.simulate("two", "--threads", "2", vectors=width)
        self.judge_same("two", f"with two threads and TOILE_VECTORS={width}")

    def judge_resumed(self, part):
        """Kills a run that has written that part of its bytes, and goes on with it."""
        states, whole = self.path("parts/run.states"), os.path.getsize(self.path("one/run.states"))
        child = subprocess.Popen(self.command("parts", "--threads", "1"), stderr=subprocess.DEVNULL)
        while child.poll() is None:
            if os.path.exists(states) and os.path.getsize(states) >= part * whole:
                child.kill()
            time.sleep(0.002)
        self.simulate("parts", "--threads", "1", "--resume")
        self.judge_same("parts", "after a kill and --resume")

    def judge(self):
        """passed, refused, slow or stopped; anything else raises a Failure."""
        done = self.start(*self.command("one", "--threads", "1"))
        if done.returncode == 65:
            self.judge_refusal(done)
            return "refused: " + last_words(done.stderr)
        slow = done.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
        stopped = done.returncode == 1 and any(text in done.stderr for text in STOPS)
        need(done.returncode == 0 or slow or stopped,
             f"exit code {done.returncode}: {last_words(done.stderr)}")
        self.judge_frames(done.returncode == 0)
        if slow or stopped:
            return "slow" if slow else "stopped: " + last_words(done.stderr)
        if self.seed % 3 == 1:
            self.judge_threads()
        elif self.seed % 3 == 2:
            self.judge_resumed(random.Random(self.seed).uniform(0.2, 0.9))
        return "passed"


def try_seed(seed, folder, cpu):
    """Whether the scene passed. It stays if it did not."""
    start, trial = time.monotonic(), Trial(seed, folder, cpu)
    try:
        verdict, good = trial.judge(), True
    except Failure as failure:
        verdict, good = f"FAILED: {failure}", False
    print(f"{seed} {trial.stepper} {time.monotonic() - start:.1f} s {verdict}", flush=True)
    shutil.rmtree(trial.runs)
    if good:
        os.remove(trial.scene)
    else:
        print(f"  {trial.scene}; again: tests/fuzz/scenes.py --first {seed} --count 1", flush=True)
    return good


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--first", type=int, default=1, metavar="SEED", help="the first scene; 1")
    parser.add_argument("--count", type=int, default=250, metavar="N", help="how many; 250")
    parser.add_argument("--cpu", type=int, default=60, metavar="SECONDS", help="CPU time of one run; 60")
    parser.add_argument("-o", "--output", metavar="FOLDER",
                        default=os.path.join(ROOT, "build", "fuzz", "scenes"),
                        help="for the scenes that fail; build/fuzz/scenes")
    arguments = parser.parse_args()
    for program in (SIM, RENDER):
        if not os.path.exists(program):
            print(f"scenes: {program} is missing: run make", file=sys.stderr)
            return 66
    os.environ.setdefault("LSAN_OPTIONS", f"print_suppressions=0:suppressions={ROOT}/scripts/lsan.txt")
    seeds = range(arguments.first, arguments.first + arguments.count)
    passed = sum(try_seed(seed, arguments.output, arguments.cpu) for seed in seeds)
    print(f"{passed} passed, {len(seeds) - passed} failed")
    return 0 if passed == len(seeds) else 1


if __name__ == "__main__":
    sys.exit(main())
