"""Scaffolder: a part filled with a gyroid.

    scaffolder_worker.py fill MESH.ply CELLS N OUT.ply
"""

import math
import sys

import numpy as np
import PyScaffolder
from common import Work, read_ply, write_ply


def main(mesh, cells, n, out):
    vertices, triangles = read_ply(mesh)
    work = Work()
    wanted = PyScaffolder.Parameter()
    wanted.surface_name, wanted.isolevel, wanted.grid_size = "gyroid", 0.0, n
    wanted.coff = 2 * math.pi * cells / np.ptp(vertices, axis=0).max()
    wanted.is_build_inverse, wanted.verbose = False, False
    wanted.k_slice, wanted.qsim_percent = 0, 0.0
    made = PyScaffolder.generate_scaffold(vertices, triangles, wanted)
    corners = np.asarray(made.f)
    write_ply(out, np.asarray(made.v), corners)
    work.finish(triangles=len(corners))


_, _, mesh, cells, n, out = sys.argv
main(mesh, float(cells), int(n), out)
