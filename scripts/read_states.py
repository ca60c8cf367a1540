#!/usr/bin/python3
"""Reads states files (RUN/run.states) with numpy; written from the comment in sim/state/state.h.

    read_states.py RUN              what is in it
    read_states.py RUN --csv        one line of numbers a frame
    read_states.py RUN --frame 12   one frame: the positions of all nodes, in full precision

As a module:

    states = read_states.States("build/demo/sleeve.run")
    for frame in states.frames:
        x = frame["x"]                            # (nodes, 3) [m]
        surface = frame.layout.surface(x)         # (vertices, 3) [m], s = W x
"""
import argparse
import os
import signal
import struct
import sys

import numpy as np

try:
    import xxhash  # checks the checksums; without it they are believed
except ImportError:
    xxhash = None

MAGIC, VERSION = b"TOILEST\n", 1
KINDS = (b"HEAD", b"LAYO", b"FRAM", b"DONE")
TYPES = {1: np.dtype("u1"), 2: np.dtype("<i4"), 3: np.dtype("<i8"), 4: np.dtype("<f8")}
FILM = ("rate", "frame_count", "width", "height", "camera", "eye.x", "eye.y", "eye.z", "target.x",
        "target.y", "target.z", "up.x", "up.y", "up.z", "fov", "pixels_per_mm", "floor",
        "floor_height")
SOLIDS = ("plane", "sphere", "box", "cylinder", "capsule", "cone", "mesh")


class Damage(Exception):
    """A record that is not what its layout demands."""


class Torn(Exception):
    """The file ends inside a record: it is still written, or its writer was stopped."""


def need(condition, text):
    if not condition:
        raise Damage(text)


def read_array(payload, at):
    """One array of a record and where the next one starts."""
    need(at + 40 <= len(payload), "an array head is cut off")
    name, kind, components, count = struct.unpack_from("<24sIIQ", payload, at)
    need(kind in TYPES, f"type {kind} of an array is unknown")
    need(components > 0, "an array without components")
    size = TYPES[kind].itemsize * components * count
    at += 40
    need(at + size <= len(payload), "an array is longer than its record")
    data = np.frombuffer(payload, TYPES[kind], components * count, at)
    return name.rstrip(b"\0").decode(), data.reshape(-1, components), at + (size + 7) // 8 * 8


def read_record(file):
    """(kind, {name: array}), None at the end of the file."""
    head = file.read(24)
    if not head:
        return None
    if len(head) < 24:
        raise Torn
    kind, arrays, size, checksum = struct.unpack("<4sIQQ", head)
    need(kind in KINDS, "no record starts here")
    need(size % 8 == 0 and size <= 1 << 34 and arrays <= 256, "the record's size is impossible")
    payload = file.read(size)
    if len(payload) < size:
        raise Torn
    need(xxhash is None or xxhash.xxh3_64_intdigest(payload) == checksum, "the checksum is wrong")
    record, at = {}, 0
    for _ in range(arrays):
        name, data, at = read_array(payload, at)
        record[name] = data
    need(at == size, "the arrays do not fill the record")
    return kind, record


def text(record, name):
    return record[name].tobytes().decode() if name in record else ""


def flat(record, name, count=None):
    need(name in record and record[name].shape[1] == 1, f"array {name} is missing")
    need(count is None or len(record[name]) == count, f"array {name} has a wrong length")
    return record[name][:, 0]


def table(record, name, columns, rows=None):
    need(name in record and record[name].shape[1] == columns, f"array {name} is missing")
    need(rows is None or len(record[name]) == rows, f"array {name} has a wrong length")
    return record[name]


def check_ranges(begin, total, name):
    need(len(begin) > 0 and begin[0] == 0 and begin[-1] == total and np.all(np.diff(begin) >= 0),
         f"{name} is not a list of ranges")


def check_indices(indices, below, name):
    need(indices.size == 0 or (indices.min() >= 0 and indices.max() < below),
         f"{name} points outside")


class Header:
    def __init__(self, record):
        self.program = text(record, "program")
        self.scene_path = text(record, "scene_path")
        self.scene_text = text(record, "scene_text")
        self.scene_hash = int(flat(record, "scene_hash", 1)[0]) & (1 << 64) - 1
        self.film = dict(zip(FILM, flat(record, "film", len(FILM)).tolist()))
        thickness = flat(record, "cloth.thickness")
        cloths = [line.split(" ") for line in text(record, "cloth.text").splitlines()]
        need(len(cloths) == len(thickness) and all(len(c) == 3 for c in cloths), "cloth.text")
        self.cloths = [dict(name=c[0], fabric=c[1], look=c[2], thickness=float(t))
                       for c, t in zip(cloths, thickness)]
        solids = table(record, "obstacle.solid", 5)
        names = [line.split(" ") for line in text(record, "obstacle.text").splitlines()]
        need(len(names) == len(solids) and all(len(n) == 2 for n in names), "obstacle.text")
        need(all(s[0] in range(len(SOLIDS)) for s in solids), "an unknown kind of obstacle")
        self.obstacles = [dict(name=n[0], look=n[1], kind=SOLIDS[int(s[0])], half=s[1:4].tolist(),
                               radius=float(s[4])) for n, s in zip(names, solids)]
        self.moved_count = 0
        if any(o["kind"] == "mesh" for o in self.obstacles):
            self.read_meshes(record)

    def read_meshes(self, record):
        """obstacle["vertices"], ["triangles"], ["moves"], ["closed"] of each mesh; ["moved"]: its rows of
        frame["obstacle.moved"]."""
        begin = table(record, "obstacle.mesh_begin", 2, len(self.obstacles) + 1)
        vertices, triangles = (table(record, "obstacle.vertex", 3),
                               table(record, "obstacle.triangle", 3))
        flags = flat(record, "obstacle.flags", len(self.obstacles))
        check_ranges(begin[:, 0], len(vertices), "obstacle.mesh_begin")
        check_ranges(begin[:, 1], len(triangles), "obstacle.mesh_begin")
        for i, obstacle in enumerate(self.obstacles):
            if obstacle["kind"] == "mesh":
                (v, t), (v_end, t_end) = begin[i], begin[i + 1]
                need(v_end > v and t_end > t, "an empty mesh")
                check_indices(triangles[t:t_end], v_end - v, "obstacle.triangle")
                obstacle.update(vertices=vertices[v:v_end], triangles=triangles[t:t_end],
                                moves=bool(flags[i] & 1), closed=bool(flags[i] & 2))
                if obstacle["moves"]:
                    rows = slice(self.moved_count, self.moved_count + int(v_end - v))
                    obstacle["moved"], self.moved_count = rows, rows.stop


class Layout:
    def __init__(self, record, cloths):
        self.lattice = table(record, "lattice", 4, cloths)
        self.material = table(record, "material", 2)
        self.node_count = len(self.material)
        self.rest = table(record, "rest", 3, self.node_count)
        self.vertex_material = table(record, "vertex_material", 2)
        self.vertex_count = len(self.vertex_material)
        self.triangles = table(record, "triangles", 3)
        self.node_begin = flat(record, "node_begin", cloths + 1)
        self.vertex_begin = flat(record, "vertex_begin", cloths + 1)
        self.triangle_begin = flat(record, "triangle_begin", cloths + 1)
        self.w_column, self.w_value = flat(record, "w.column"), flat(record, "w.value")
        self.w_start = flat(record, "w.start")
        self.outline, self.outline_begin = table(record, "outline", 2), flat(record, "outline_begin")
        self.loop_begin = flat(record, "loop_begin", cloths + 1)
        self.verify()

    def verify(self):
        check_ranges(self.node_begin, self.node_count, "node_begin")
        check_ranges(self.vertex_begin, self.vertex_count, "vertex_begin")
        check_ranges(self.triangle_begin, len(self.triangles), "triangle_begin")
        check_ranges(self.outline_begin, len(self.outline), "outline_begin")
        check_ranges(self.loop_begin, len(self.outline_begin) - 1, "loop_begin")
        check_indices(self.triangles, self.vertex_count, "triangles")
        need(len(self.w_value) == len(self.w_column), "w.column and w.value differ in length")
        if len(self.w_value) == 0:
            need(self.vertex_count == self.node_count, "W is the identity of another size")
        else:
            need(len(self.w_start) == self.vertex_count + 1, "w.start has a wrong length")
            check_ranges(self.w_start, len(self.w_value), "w.start")
            check_indices(self.w_column, self.node_count, "w.column")
        for c, (u, v, wraps, _) in enumerate(self.lattice):
            nodes = self.node_begin[c + 1] - self.node_begin[c]
            need((u, v) == (0, 0) or (int(u) * int(v) == nodes and wraps in (0, 1)),
                 "a lattice does not hold its cloth's nodes")

    def surface(self, x):
        """s = W x: (vertex_count, 3)."""
        if len(self.w_value) == 0:
            return x
        rows = np.repeat(np.arange(self.vertex_count), np.diff(self.w_start))
        surface = np.zeros((self.vertex_count, 3))
        np.add.at(surface, rows, self.w_value[:, None] * x[self.w_column])
        return surface


class Frame:
    """One frame. frame["x"] and so on are its arrays; .layout is the one it was made with."""

    def __init__(self, record, header, layout):
        need(layout is not None, "a frame stands before the first layout")
        self.record, self.layout = record, layout
        self.number = int(flat(record, "frame", 1)[0])
        self.time = float(flat(record, "time", 1)[0])
        for name in ("x", "v"):
            need(np.isfinite(table(record, name, 3, layout.node_count)).all(),
                 f"array {name} holds a number that is not finite")
        table(record, "pose", 7, len(header.obstacles))
        if header.moved_count:
            need(np.isfinite(table(record, "obstacle.moved", 3, header.moved_count)).all(),
                 "obstacle.moved holds a number that is not finite")
        names = text(record, "statistics").splitlines()
        values = flat(record, "stat") if "stat" in record else []
        self.statistics = dict(zip(names, [float(v) for v in values]))

    def __getitem__(self, name):
        return self.record[name]


class States:
    """A whole file. .damage says what is wrong with its end; "" when nothing is."""

    def __init__(self, path):
        path = os.path.join(path, "run.states") if os.path.isdir(path) else path
        self.frames, self.layouts, self.done, self.damage = [], [], None, ""
        with open(path, "rb") as file:
            head = file.read(16)
            need(len(head) == 16 and head[:8] == MAGIC and head[12:] == bytes(4),
                 f"{path}: not a toile states file")
            version = struct.unpack_from("<I", head, 8)[0]
            need(version == VERSION, f"{path}: version {version} of the format, not {VERSION}")
            try:
                kind, record = read_record(file) or (None, None)
            except Torn:
                raise Damage(f"{path}: the file ends inside the header") from None
            need(kind == b"HEAD", f"{path}: the header is missing")
            self.header = Header(record)
            self.read_rest(file)

    def read_rest(self, file):
        while self.done is None:
            at = file.tell()
            try:
                found = read_record(file)
                if found is None:
                    return
                kind, record = found
                need(kind != b"HEAD", "a second header")
                if kind == b"LAYO":
                    self.layouts.append(Layout(record, len(self.header.cloths)))
                elif kind == b"FRAM":
                    layout = self.layouts[-1] if self.layouts else None
                    self.frames.append(Frame(record, self.header, layout))
                else:
                    self.done = text(record, "reason")
            except Torn:
                return
            except Damage as damage:
                self.damage = f"damaged at byte {at}: {damage}"
                return


def row_of(frame):
    low, high = frame["x"].min(axis=0), frame["x"].max(axis=0)
    speed = float(np.sqrt((frame["v"] ** 2).sum(axis=1)).max())
    row = {"frame": frame.number, "time": frame.time}
    row.update(zip(("x_min", "y_min", "z_min", "x_max", "y_max", "z_max"), (*low, *high)))
    row["largest_speed"] = speed
    row.update((k if k not in row else "stat_" + k, v) for k, v in frame.statistics.items())
    return row


def print_csv(states):
    for i, frame in enumerate(states.frames):
        row = row_of(frame)
        if i == 0:
            print(",".join(row))
        print(",".join(repr(float(v)) if isinstance(v, float) else str(v) for v in row.values()))


def print_frame(frame):
    for position in frame["x"]:
        print(",".join(repr(float(v)) for v in position))


def print_summary(states):
    header = states.header
    print(f"{header.program}, scene {header.scene_path}, hash {header.scene_hash:016x}")
    layout = states.layouts[-1] if states.layouts else None
    for c, cloth in enumerate(header.cloths):
        line = f"cloth {cloth['name']}: {cloth['fabric']}, {1e3 * cloth['thickness']:.3g} mm thick"
        if layout is not None:
            u, v, wraps, _ = layout.lattice[c]
            nodes = layout.node_begin[c + 1] - layout.node_begin[c]
            kind = f"{u} x {v}{' around' if wraps else ''}" if u else "scattered"
            line += f", {nodes} nodes ({kind})"
        print(line)
    for obstacle in header.obstacles:
        size = f", {len(obstacle['triangles'])} triangles" if "triangles" in obstacle else ""
        print(f"obstacle {obstacle['name']}: {obstacle['kind']}{size}")
    end = states.done if states.done is not None else "not finished"
    wanted = int(header.film["frame_count"])
    print(f"{len(states.frames)} of {wanted} frames, {len(states.layouts)} layouts; {end}")
    if states.frames:
        last = states.frames[-1]
        print(f"time {states.frames[0].time:g} to {last.time:g} s at {header.film['rate']:g}/s")
        low = np.min([f["x"].min(axis=0) for f in states.frames], axis=0)
        high = np.max([f["x"].max(axis=0) for f in states.frames], axis=0)
        print("bounds [m] " + " ".join(f"{a:.4f}..{b:.4f}" for a, b in zip(low, high)))
        for name, value in last.statistics.items():
            print(f"  {name:24} {value:.6g}  (last frame)")
    if xxhash is None:
        print("checksums not checked: python3-xxhash is not installed", file=sys.stderr)


def main():
    parser = argparse.ArgumentParser(description="reads the states file of a run")
    parser.add_argument("run", help="a run directory, or its run.states")
    parser.add_argument("--csv", action="store_true", help="one line of numbers a frame")
    parser.add_argument("--frame", type=int, metavar="I", help="positions of frame I, from 0")
    arguments = parser.parse_args()
    signal.signal(signal.SIGPIPE, signal.SIG_DFL)
    try:
        states = States(arguments.run)
    except FileNotFoundError as error:
        print(f"read_states: {error.filename}: not there", file=sys.stderr)
        return 66
    except OSError as error:
        print(f"read_states: {error}", file=sys.stderr)
        return 74
    except Damage as damage:
        print(f"read_states: {damage}", file=sys.stderr)
        return 65
    if arguments.frame is not None:
        if not 0 <= arguments.frame < len(states.frames):
            print(f"read_states: there are {len(states.frames)} frames", file=sys.stderr)
            return 2
        print_frame(states.frames[arguments.frame])
    elif arguments.csv:
        print_csv(states)
    else:
        print_summary(states)
    if states.damage:
        print(f"read_states: {states.damage}", file=sys.stderr)
        return 65
    return 0


if __name__ == "__main__":
    sys.exit(main())
