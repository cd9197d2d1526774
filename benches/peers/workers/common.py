"""What the workers share: a clock, the answer, the headline field, plain files.

A worker runs in the environment of its peer, does one job and prints one JSON object. Its CPU
seconds begin after the imports.
"""

import json
import math
import time

import numpy as np


class Work:
    """Clocks started when made; `finish` prints the answer."""

    def __init__(self):
        self.wall, self.cpu = time.perf_counter(), time.process_time()

    def finish(self, **answer):
        answer["cpu"] = time.process_time() - self.cpu
        answer["wall"] = time.perf_counter() - self.wall
        tell(answer)


def tell(answer):
    """Prints the answer, with the largest resident set so far."""
    with open("/proc/self/status") as status:
        peak = next(line for line in status if line.startswith("VmHWM:"))
    print(json.dumps(answer | {"peak": int(peak.split()[1]) * 1024}))


def query(count, build, ask, read=np.asarray):
    """Asks for the distances of `count` points and prints what that cost.

    `build` makes what is needed before. `read` makes an array of what `ask` returns, off the
    clock; distances are negative inside.
    """
    begin = time.process_time()
    build()
    start = time.process_time()
    found = ask()
    seconds = time.process_time() - start
    distances = np.asarray(read(found), np.float64)
    tell({
        "nanoseconds": 1e9 * seconds / count,
        "nanoseconds_built": 1e9 * (seconds + start - begin) / count,
        "points": count,
        "inside": int((distances < 0).sum()),
        "mean": float(np.abs(distances).mean()),
    })


def gyroid_in_box(n):
    """max(gyroid, box) at n^3 samples, float32, negative inside, with the first coordinate and the step.

    The faces of [-1, 1]^3 lie in the middle of the outermost cells, so that they come out flat.
    Sines and cosines are taken along the axes only.
    """
    step = 2.0 / (n - 2)
    at = -1.0 - step / 2 + step * np.arange(n)
    sine, cosine = (f(2 * np.pi * at).astype(np.float32) for f in (np.sin, np.cos))
    wall = (np.abs(at) - 1).astype(np.float32)
    field = sine[:, None, None] * cosine[None, :, None] + np.zeros((1, 1, n), np.float32)
    field += (sine[:, None] * cosine[None, :])[None, :, :]
    field += (cosine[:, None] * sine[None, :])[:, None, :]
    for axis in range(3):
        np.maximum(field, wall.reshape([-1 if a == axis else 1 for a in range(3)]), out=field)
    return field, at[0], step


def gyroid_fill(points, period):
    """The gyroid of that period at points of shape (n, 3)."""
    x, y, z = (points * np.float32(2 * math.pi / period)).T
    return np.sin(x) * np.cos(y) + np.sin(y) * np.cos(z) + np.sin(z) * np.cos(x)


def read_ply(path):
    """Vertices and triangles of a binary PLY file of float coordinates and int indices."""
    with open(path, "rb") as file:
        counts = {}
        while (line := file.readline().decode().split()) != ["end_header"]:
            if line[0] == "element":
                counts[line[1]] = int(line[2])
        vertices = np.fromfile(file, "<f4", 3 * counts["vertex"]).reshape(-1, 3)
        faces = np.fromfile(file, [("count", "u1"), ("corners", "<i4", 3)], counts["face"])
    return vertices.astype(np.float64), np.ascontiguousarray(faces["corners"])


def write_ply(path, vertices, triangles):
    """A binary PLY file of float coordinates and int indices."""
    faces = np.empty(len(triangles), [("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, triangles
    header = (
        "ply\nformat binary_little_endian 1.0\n"
        f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    with open(path, "wb") as file:
        file.write(header.encode())
        np.ascontiguousarray(vertices, "<f4").tofile(file)
        faces.tofile(file)


def places(points, vertices):
    """The points of a file of f64 triples, or of a grid of that side around the vertices.

    The grid spans their box grown by a tenth of its size, x slowest.
    """
    if not points.isdigit():
        return np.fromfile(points).reshape(-1, 3)
    low, high = box(vertices)
    lines = [np.linspace(low[a], high[a], int(points)) for a in range(3)]
    return np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 3)


def box(vertices):
    """The box of the vertices, grown by a tenth of its size at each end."""
    low, high = vertices.min(0), vertices.max(0)
    return low - 0.1 * (high - low), high + 0.1 * (high - low)
