"""Open3D: contours, distances, and a part filled by both.

    open3d_worker.py contour N OUT.ply
    open3d_worker.py distance MESH.ply POINTS|SIDE
    open3d_worker.py fill MESH.ply CELLS N OUT.ply
"""

import sys

import numpy as np
from common import Work, gyroid_fill, gyroid_in_box, places, query, read_ply, write_ply
from open3d.core import Tensor
from open3d.t.geometry import RaycastingScene, TriangleMesh


def scene(vertices, triangles):
    made = RaycastingScene()
    made.add_triangles(Tensor(vertices.astype(np.float32)), Tensor(triangles.astype(np.uint32)))
    return made


def contour(n, out):
    work = Work()
    field, low, step = gyroid_in_box(n)
    mesh = TriangleMesh.create_isosurfaces(field, [0.0])
    vertices = mesh.vertex.positions.numpy() * np.float32(step) + np.float32(low)
    triangles = mesh.triangle.indices.numpy()
    # The plain writer takes a sixth of the time of the package's own.
    write_ply(out, vertices, triangles)
    work.finish(triangles=len(triangles))


def distance(mesh, points):
    vertices, triangles = read_ply(mesh)
    at = Tensor(places(points, vertices).astype(np.float32))
    asked = scene(vertices, triangles)
    # The first query builds the tree.
    build = lambda: asked.compute_distance(at[:1])
    query(len(at), build, lambda: asked.compute_signed_distance(at).numpy())


def fill(mesh, cells, n, out):
    vertices, triangles = read_ply(mesh)
    work = Work()
    low, size = vertices.min(0), np.ptp(vertices, axis=0)
    step = size.max() / (n - 3)
    counts = np.ceil(size / step).astype(int) + 4
    lines = [low[a] + step * (np.arange(counts[a]) - 1.5) for a in range(3)]
    at = np.stack(np.meshgrid(*lines, indexing="ij"), -1).reshape(-1, 3).astype(np.float32)
    part = scene(vertices, triangles).compute_signed_distance(Tensor(at)).numpy()
    period = size.max() / cells
    level = gyroid_fill(at, period) * np.float32(period / (2 * np.pi))
    field = np.maximum(part, level).reshape(counts)
    made = TriangleMesh.create_isosurfaces(field, [0.0])
    # Vertices come with the last axis of the array first.
    nodes = made.vertex.positions.numpy()[:, ::-1]
    triangles = made.triangle.indices.numpy()
    write_ply(out, nodes * np.float32(step) + np.float32([line[0] for line in lines]), triangles)
    work.finish(triangles=len(triangles))


_, job, *rest = sys.argv
if job == "contour":
    contour(int(rest[0]), rest[1])
elif job == "distance":
    distance(*rest)
else:
    fill(rest[0], float(rest[1]), int(rest[2]), rest[3])
