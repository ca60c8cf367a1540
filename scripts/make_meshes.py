#!/usr/bin/python3
"""Makes the meshes of assets/meshes/: make_meshes.py [FOLDER]. Needs nothing but Python 3.

icosphere.obj   1,280 triangles, radius 1, around the origin
torus.ply       6,400 triangles, radii 0.30 and 0.10, around the z axis (binary)
l-shape.stl     20 triangles, closed, with one edge that points inward
mannequin.glb   a dress form of 1.4 m, 2,304 triangles, with a skeleton of three bones that turns its
                hips and chest against each other and bobs, 4 s, as when walking on the spot
"""
import json
import math
import os
import struct
import sys


def icosphere(level):
    g = (1 + math.sqrt(5)) / 2
    points = [(-1, g, 0), (1, g, 0), (-1, -g, 0), (1, -g, 0), (0, -1, g), (0, 1, g),
              (0, -1, -g), (0, 1, -g), (g, 0, -1), (g, 0, 1), (-g, 0, -1), (-g, 0, 1)]
    faces = [(0, 11, 5), (0, 5, 1), (0, 1, 7), (0, 7, 10), (0, 10, 11), (1, 5, 9), (5, 11, 4),
             (11, 10, 2), (10, 7, 6), (7, 1, 8), (3, 9, 4), (3, 4, 2), (3, 2, 6), (3, 6, 8),
             (3, 8, 9), (4, 9, 5), (2, 4, 11), (6, 2, 10), (8, 6, 7), (9, 8, 1)]

    def unit(p):
        length = math.sqrt(sum(c * c for c in p))
        return tuple(c / length for c in p)

    points = [unit(p) for p in points]
    for _ in range(level):
        middles, finer = {}, []

        def middle(a, b):
            key = (min(a, b), max(a, b))
            if key not in middles:
                middles[key] = len(points)
                points.append(unit([0.5 * (p + q) for p, q in zip(points[a], points[b])]))
            return middles[key]

        for a, b, c in faces:
            ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
            finer += [(a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca)]
        faces = finer
    return points, faces


def torus(around, across, big, small):
    points, faces = [], []
    for i in range(around):
        for j in range(across):
            u, v = 2 * math.pi * i / around, 2 * math.pi * j / across
            r = big + small * math.cos(v)
            points.append((r * math.cos(u), r * math.sin(u), small * math.sin(v)))
            a, b = i * across + j, (i + 1) % around * across + j
            c, d = i * across + (j + 1) % across, (i + 1) % around * across + (j + 1) % across
            faces += [(a, b, d), (a, d, c)]
    return points, faces


def l_shape(size, height):
    """A prism over an L: two squares of `size` removed from a larger one."""
    outline = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
    flat = [(0, 1, 3), (1, 2, 3), (0, 3, 5), (3, 4, 5)]
    points = [(size * x, size * y, z) for z in (0, height) for x, y in outline]
    faces = [(c, b, a) for a, b, c in flat] + [(a + 6, b + 6, c + 6) for a, b, c in flat]
    for i in range(6):
        j = (i + 1) % 6
        faces += [(i, j, j + 6), (i, j + 6, i + 6)]
    return points, faces


def write_obj(path, points, faces):
    with open(path, "w") as out:
        out.write("# made by scripts/make_meshes.py\n")
        for p in points:
            out.write("v %.7f %.7f %.7f\n" % tuple(p))
        for f in faces:
            out.write("f %d %d %d\n" % tuple(i + 1 for i in f))


def write_ply(path, points, faces):
    with open(path, "wb") as out:
        out.write(("ply\nformat binary_little_endian 1.0\ncomment made by scripts/make_meshes.py\n"
                   "element vertex %d\nproperty float x\nproperty float y\nproperty float z\n"
                   "element face %d\nproperty list uchar int vertex_indices\nend_header\n"
                   % (len(points), len(faces))).encode())
        for p in points:
            out.write(struct.pack("<3f", *p))
        for f in faces:
            out.write(struct.pack("<B3i", 3, *f))


def write_stl(path, points, faces):
    with open(path, "w") as out:
        out.write("solid l-shape\n")
        for f in faces:
            out.write("facet normal 0 0 0\n outer loop\n")
            for i in f:
                out.write("  vertex %g %g %g\n" % tuple(points[i]))
            out.write(" endloop\nendfacet\n")
        out.write("endsolid l-shape\n")


# (height, half width, half depth) of the form's cross-sections, metres; closed at both ends
FORM = [(0.00, 0.150, 0.105), (0.04, 0.165, 0.115), (0.10, 0.175, 0.122), (0.18, 0.178, 0.125),
        (0.26, 0.165, 0.115), (0.34, 0.142, 0.100), (0.40, 0.132, 0.094), (0.46, 0.138, 0.100),
        (0.54, 0.152, 0.115), (0.60, 0.160, 0.124), (0.66, 0.165, 0.115), (0.72, 0.178, 0.100),
        (0.76, 0.185, 0.090), (0.79, 0.170, 0.080), (0.82, 0.120, 0.070), (0.845, 0.070, 0.062),
        (0.87, 0.056, 0.056), (0.92, 0.054, 0.056), (0.95, 0.062, 0.070), (0.98, 0.072, 0.085),
        (1.03, 0.077, 0.095), (1.08, 0.074, 0.092), (1.12, 0.058, 0.074), (1.145, 0.034, 0.044)]
BASE = 0.25  # of the form above the ground
AROUND = 48


def mannequin():
    """Points with y up, as glTF wants them, faces, and the weights of hips, chest, head."""
    points, faces, weights = [(0.0, BASE - 0.005, 0.0)], [], [(1.0, 0.0, 0.0)]
    rings = len(FORM)
    for height, wide, deep in FORM:
        chest = min(max((height - 0.25) / 0.30, 0.0), 1.0)
        chest = chest * chest * (3 - 2 * chest)
        head = min(max((height - 0.84) / 0.10, 0.0), 1.0)
        for j in range(AROUND):
            angle = 2 * math.pi * j / AROUND
            points.append((wide * math.cos(angle), BASE + height, deep * math.sin(angle)))
            weights.append((1 - chest, chest * (1 - head), chest * head))
    points.append((0.0, BASE + FORM[-1][0] + 0.01, 0.0))
    weights.append((0.0, 0.0, 1.0))
    top = len(points) - 1
    for j in range(AROUND):
        k = (j + 1) % AROUND
        faces.append((0, 1 + j, 1 + k))
        for i in range(rings - 1):
            a, b = 1 + i * AROUND + j, 1 + i * AROUND + k
            c, d = a + AROUND, b + AROUND
            faces += [(a, c, d), (a, d, b)]
        last = 1 + (rings - 1) * AROUND
        faces.append((last + j, top, last + k))
    return points, faces, weights


def quaternion(axis, degrees):
    half = math.radians(degrees) / 2
    return [axis[0] * math.sin(half), axis[1] * math.sin(half), axis[2] * math.sin(half),
            math.cos(half)]


class Buffer:
    """The binary chunk of a GLB and what describes it."""

    def __init__(self):
        self.data, self.views, self.accessors = b"", [], []

    def add(self, numbers, kind, code, component, target=None, bounds=False):
        size = {"SCALAR": 1, "VEC3": 3, "VEC4": 4, "MAT4": 16}[kind]
        flat = [x for item in numbers for x in (item if size > 1 else [item])]
        raw = struct.pack("<%d%s" % (len(flat), code), *flat)
        view = {"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw)}
        if target:
            view["target"] = target
        accessor = {"bufferView": len(self.views), "componentType": component,
                    "count": len(numbers), "type": kind}
        if bounds:
            items = [struct.unpack("<%df" % size, struct.pack("<%df" % size,
                     *(n if size > 1 else [n]))) for n in numbers]
            accessor["min"] = [min(i[k] for i in items) for k in range(size)]
            accessor["max"] = [max(i[k] for i in items) for k in range(size)]
        self.views.append(view)
        self.accessors.append(accessor)
        self.data += raw + b"\0" * (-len(raw) % 4)
        return len(self.accessors) - 1


FLOAT, SHORT, BYTE = 5126, 5123, 5121
HIPS, CHEST, HEAD = BASE + 0.15, BASE + 0.42, BASE + 0.88  # heights of the joints


def write_mannequin(path):
    points, faces, weights = mannequin()
    buffer = Buffer()
    position = buffer.add(points, "VEC3", "f", FLOAT, 34962, True)
    joints = buffer.add([(0, 1, 2, 0)] * len(points), "VEC4", "B", BYTE, 34962)
    weight = buffer.add([w + (0.0,) for w in weights], "VEC4", "f", FLOAT, 34962)
    indices = buffer.add([i for f in faces for i in f], "SCALAR", "H", SHORT, 34963)
    inverse = buffer.add([(1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, -h, 0, 1)
                          for h in (HIPS, CHEST, HEAD)], "MAT4", "f", FLOAT)
    times = [k / 10 for k in range(41)]  # 4 s, two steps a second, gently started

    def swing(t, degrees):
        start = min(t, 1.0)
        return degrees * start * start * (3 - 2 * start) * math.sin(2 * math.pi * t)

    clock = buffer.add(times, "SCALAR", "f", FLOAT, None, True)
    hips = buffer.add([quaternion((0, 1, 0), swing(t, 20)) for t in times], "VEC4", "f", FLOAT)
    chest = buffer.add([quaternion((0, 1, 0), swing(t, -30)) for t in times], "VEC4", "f", FLOAT)
    head = buffer.add([quaternion((0, 1, 0), swing(t, 10)) for t in times], "VEC4", "f", FLOAT)
    bob = buffer.add([(0.01 * swing(t, 1), HIPS + 0.02 * abs(swing(t, 1)), 0) for t in times],
                     "VEC3", "f", FLOAT)
    samplers = [{"input": clock, "output": o} for o in (hips, chest, head, bob)]
    channels = [{"sampler": 0, "target": {"node": 1, "path": "rotation"}},
                {"sampler": 1, "target": {"node": 2, "path": "rotation"}},
                {"sampler": 2, "target": {"node": 3, "path": "rotation"}},
                {"sampler": 3, "target": {"node": 1, "path": "translation"}}]
    text = {"asset": {"version": "2.0", "generator": "toile scripts/make_meshes.py"},
            "scene": 0, "scenes": [{"nodes": [0, 1]}],
            "nodes": [{"name": "mannequin", "mesh": 0, "skin": 0},
                      {"name": "hips", "translation": [0, HIPS, 0], "children": [2]},
                      {"name": "chest", "translation": [0, CHEST - HIPS, 0], "children": [3]},
                      {"name": "head", "translation": [0, HEAD - CHEST, 0]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": position, "JOINTS_0": joints,
                                                       "WEIGHTS_0": weight},
                                        "indices": indices}]}],
            "skins": [{"joints": [1, 2, 3], "inverseBindMatrices": inverse, "skeleton": 1}],
            "animations": [{"name": "walk", "samplers": samplers, "channels": channels}],
            "buffers": [{"byteLength": len(buffer.data)}],
            "bufferViews": buffer.views, "accessors": buffer.accessors}
    head = json.dumps(text, separators=(",", ":")).encode()
    head += b" " * (-len(head) % 4)
    with open(path, "wb") as out:
        out.write(struct.pack("<4sII", b"glTF", 2, 28 + len(head) + len(buffer.data)))
        out.write(struct.pack("<I4s", len(head), b"JSON") + head)
        out.write(struct.pack("<I4s", len(buffer.data), b"BIN\0") + buffer.data)


def main():
    folder = sys.argv[1] if len(sys.argv) > 1 else "assets/meshes"
    write_obj(os.path.join(folder, "icosphere.obj"), *icosphere(3))
    write_ply(os.path.join(folder, "torus.ply"), *torus(80, 40, 0.30, 0.10))
    write_stl(os.path.join(folder, "l-shape.stl"), *l_shape(0.1, 0.1))
    write_mannequin(os.path.join(folder, "mannequin.glb"))


if __name__ == "__main__":
    main()
