"""MeshLib: distances, and a part filled by its own lattice.

    meshlib_worker.py distance MESH.ply POINTS|SIDE SIGN     SIGN is normals or winding
    meshlib_worker.py fill MESH.ply CELLS N OUT.ply          its double gyroid: another solid
"""

import sys

import numpy as np
from common import Work, box, places, query, read_ply, write_ply
from meshlib import mrmeshnumpy, mrmeshpy


def distance(path, points, sign):
    vertices, triangles = read_ply(path)
    mesh = mrmeshnumpy.meshFromFacesVerts(triangles, vertices)
    if points.isdigit():
        grid(mesh, vertices, int(points), sign)
        return
    if sign != "normals":
        raise SystemExit("free points have signs by normals only")
    at = places(points, vertices)
    cloud = mrmeshnumpy.pointCloudFromPoints(at).points
    ask = lambda: mrmeshpy.findSignedDistances(mesh, cloud)
    query(len(at), mesh.getAABBTree, ask, lambda found: [found.vec[i] for i in range(len(at))])


def grid(mesh, vertices, side, sign):
    low, high = box(vertices)
    size = (high - low) / (side - 1)
    wanted = mrmeshpy.MeshToDistanceVolumeParams()
    # Values belong to the middles of voxels.
    wanted.vol.origin = mrmeshpy.Vector3f(*map(float, low - size / 2))
    wanted.vol.voxelSize = mrmeshpy.Vector3f(*map(float, size))
    wanted.vol.dimensions = mrmeshpy.Vector3i(side, side, side)
    modes = mrmeshpy.SignDetectionMode
    wanted.dist.signMode = {"winding": modes.HoleWindingRule, "normals": modes.ProjectionNormal}[sign]
    ask = lambda: mrmeshpy.meshToDistanceVolume(mesh, wanted)
    query(side**3, mesh.getAABBTree, ask, mrmeshnumpy.getNumpy3Darray)


def fill(path, cells, n, out):
    vertices, triangles = read_ply(path)
    size = np.ptp(vertices, axis=0).max()
    mesh = mrmeshnumpy.meshFromFacesVerts(triangles, vertices)
    work = Work()
    tpms = mrmeshpy.FillingSurface.TPMS
    wanted = tpms.MeshParams()
    wanted.type = tpms.Type.DoubleGyroid
    wanted.frequency, wanted.resolution, wanted.iso = cells / size, n / cells, 0.0
    made = tpms.fill(mesh, wanted)
    corners = mrmeshnumpy.getNumpyFaces(made.topology)
    write_ply(out, mrmeshnumpy.getNumpyVerts(made), corners)
    work.finish(triangles=len(corners))


_, job, *rest = sys.argv
if job == "distance":
    distance(*rest)
else:
    fill(rest[0], float(rest[1]), int(rest[2]), rest[3])
