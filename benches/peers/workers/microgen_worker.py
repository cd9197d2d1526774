"""microgen: a gyroid in a box, and a part filled with gyroid walls.

    microgen_worker.py box N OUT.ply                  two cells a side, one labyrinth
    microgen_worker.py fill MESH.ply CELLS N OUT.ply  walls of its own measure: another solid
"""

import sys

import microgen
import numpy as np
import pyvista
from common import Work, read_ply, write_ply
from microgen.shape.surface_functions import gyroid


def save(made, out, work):
    made = made.triangulate()
    corners = made.faces.reshape(-1, 4)[:, 1:]
    write_ply(out, made.points, corners)
    work.finish(triangles=len(corners))


def box(n, out):
    work = Work()
    made = microgen.Tpms(
        surface_function=gyroid, offset=0.0, cell_size=1.0, repeat_cell=2, resolution=n // 2
    )
    save(made.lower_skeletal, out, work)


def fill(path, cells, n, out):
    vertices, triangles = read_ply(path)
    work = Work()
    made = microgen.Infill(
        obj=pyvista.PolyData.from_regular_faces(vertices, triangles),
        surface_function=gyroid,
        offset=0.3,
        cell_size=np.ptp(vertices, axis=0).max() / cells,
        resolution=n // int(cells),
    )
    save(made.sheet, out, work)


_, job, *rest = sys.argv
if job == "box":
    box(int(rest[0]), rest[1])
else:
    fill(rest[0], float(rest[1]), int(rest[2]), rest[3])
