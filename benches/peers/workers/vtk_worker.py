"""VTK: the gyroid in a box on a grid of samples, by either of its contourers, to a PLY file.

    vtk_worker.py contour METHOD N OUT.ply      METHOD is flying-edges or marching-cubes
"""

import sys

from common import Work, gyroid_in_box
from vtkmodules.util.numpy_support import numpy_to_vtk
from vtkmodules.vtkCommonDataModel import vtkImageData
from vtkmodules.vtkFiltersCore import vtkFlyingEdges3D, vtkMarchingCubes
from vtkmodules.vtkIOPLY import vtkPLYWriter

METHODS = {"flying-edges": vtkFlyingEdges3D, "marching-cubes": vtkMarchingCubes}


def main(method, n, out):
    work = Work()
    field, low, step = gyroid_in_box(n)
    image = vtkImageData()
    image.SetDimensions(n, n, n)
    image.SetSpacing(step, step, step)
    image.SetOrigin(low, low, low)
    # VTK's x is the array's last axis: the field of a mirrored gyroid.
    image.GetPointData().SetScalars(numpy_to_vtk(field.ravel(), deep=0))
    contour = METHODS[method]()
    contour.SetInputData(image)
    contour.SetValue(0, 0.0)
    for extra in ("SetComputeNormals", "SetComputeGradients", "SetComputeScalars"):
        if hasattr(contour, extra):
            getattr(contour, extra)(0)
    writer = vtkPLYWriter()
    writer.SetInputConnection(contour.GetOutputPort())
    writer.SetFileName(out)
    writer.SetFileTypeToBinary()
    writer.Write()
    work.finish(triangles=contour.GetOutput().GetNumberOfPolys())


_, _, method, n, out = sys.argv
main(method, int(n), out)
