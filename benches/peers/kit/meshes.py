"""Meshes and points for the distance items, made from one closed mesh. Lists of tuples throughout."""

import random
import struct
from array import array
from heapq import nsmallest

# Share of a mesh's vertices that lose their triangles to holes, in five places.
HOLES, PLACES = 0.004, 5


def read_obj(path):
    """Vertices and triangles of an OBJ file of triangles."""
    vertices, triangles = [], []
    with open(path) as file:
        for line in file:
            words = line.split()
            if words and words[0] == "v":
                vertices.append(tuple(map(float, words[1:4])))
            elif words and words[0] == "f":
                triangles.append(tuple(int(word.split("/")[0]) - 1 for word in words[1:4]))
    return vertices, triangles


def write_ply(path, vertices, triangles):
    """A binary PLY file of float coordinates and int indices."""
    face = struct.Struct("<B3i")
    with open(path, "wb") as file:
        file.write(
            "ply\nformat binary_little_endian 1.0\n"
            f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
            f"element face {len(triangles)}\nproperty list uchar int vertex_indices\nend_header\n".encode()
        )
        file.write(struct.pack(f"<{3 * len(vertices)}f", *(x for vertex in vertices for x in vertex)))
        file.write(b"".join(face.pack(3, *corners) for corners in triangles))


def finer(vertices, triangles, noise):
    """Each triangle cut in four, the new vertices moved by up to `noise` along each axis.

    >>> tetrahedron = [(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]
    >>> corners = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)]
    >>> vertices, triangles = finer(corners, tetrahedron, 0.0)
    >>> len(vertices), len(triangles), vertices[4]
    (10, 16, (0.5, 0.0, 0.0))
    """
    chance, vertices, middles, made = random.Random(1), list(vertices), {}, []

    def middle(a, b):
        key = (a, b) if a < b else (b, a)
        if key not in middles:
            ends = zip(vertices[a], vertices[b])
            middles[key] = len(vertices)
            vertices.append(tuple((p + q) / 2 + chance.uniform(-noise, noise) for p, q in ends))
        return middles[key]

    for a, b, c in triangles:
        ab, bc, ca = middle(a, b), middle(b, c), middle(c, a)
        made += [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return vertices, made


def opened(vertices, triangles):
    """The triangles without those around the vertices nearest to five of them."""
    square = lambda p, q: sum((a - b) ** 2 for a, b in zip(p, q))
    count, gone = int(HOLES * len(vertices) / PLACES), set()
    for place in range(PLACES):
        centre = vertices[(2 * place + 1) * len(vertices) // (2 * PLACES)]
        gone.update(nsmallest(count, range(len(vertices)), key=lambda i: square(vertices[i], centre)))
    return vertices, [t for t in triangles if gone.isdisjoint(t)]


def sizes(vertices):
    """Least corner and side lengths of the vertices' box."""
    low = [min(axis) for axis in zip(*vertices)]
    return low, [max(axis) - lo for axis, lo in zip(zip(*vertices), low)]


def scattered(vertices, count):
    """Random points in the vertices' box grown by a tenth at each end, as bytes of f64 triples."""
    chance, (low, side) = random.Random(2), sizes(vertices)
    point = lambda: (lo + s * chance.uniform(-0.1, 1.1) for lo, s in zip(low, side))
    return array("d", (x for _ in range(count) for x in point())).tobytes()
