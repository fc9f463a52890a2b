"""VTK's CPU ray caster on a volume of bytes: 512x512 at one voxel a step, all threads.

Usage: vtk_error.py VOLUME.raw NX,NY,NZ SX,SY,SZ DISTANCE MODE OUT; MODE is composite or shaded. The camera looks at the middle from the distance,
as in benches/equal_error.rs. Writes the first frame's R, G, B bytes to OUT, from the top. One JSON line: the median seconds of a turning camera.
"""
import json
import statistics
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

SIDE, FRAMES = 512, 6
dims, spacing = [[float(v) for v in a.split(",")] for a in sys.argv[2:4]]
dims, distance, mode = [int(n) for n in dims], float(sys.argv[4]), sys.argv[5]
voxel = min(spacing)
image = vtk.vtkImageData()
image.SetDimensions(*dims)
image.SetSpacing(*spacing)
image.SetOrigin(*(-(n - 1) * s / 2 for n, s in zip(dims, spacing)))
voxels = np.fromfile(sys.argv[1], np.uint8)
image.GetPointData().SetScalars(numpy_to_vtk(voxels, deep=True))

mapper = vtk.vtkFixedPointVolumeRayCastMapper()
mapper.SetInputData(image)
mapper.SetAutoAdjustSampleDistances(0)
mapper.SetImageSampleDistance(1.0)
mapper.SetSampleDistance(voxel)
mapper.SetInteractiveSampleDistance(voxel)
mapper.SetBlendModeToComposite()
look = vtk.vtkVolumeProperty()
colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
for value, rgb in ((5, (0.1, 0.1, 0.6)), (130, (0.9, 0.5, 0.2)), (255, (1, 1, 0.9))):
    colour.AddRGBPoint(value, *rgb)
opacity.AddPoint(5, 0.0)
opacity.AddPoint(255, 0.6)
look.SetColor(colour)
look.SetScalarOpacity(opacity)
look.SetScalarOpacityUnitDistance(4 * voxel)
look.SetInterpolationTypeToLinear()
if mode == "shaded":
    look.ShadeOn()
    look.SetAmbient(0.2), look.SetDiffuse(0.7), look.SetSpecular(0.2), look.SetSpecularPower(10)
else:
    look.ShadeOff()
volume = vtk.vtkVolume()
volume.SetMapper(mapper)
volume.SetProperty(look)
renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetMultiSamples(0)
window.SetSize(SIDE, SIDE)
window.AddRenderer(renderer)
renderer.AddVolume(volume)
camera = renderer.GetActiveCamera()
camera.SetPosition(0, -distance, distance / 3)
camera.SetFocalPoint(0, 0, 0)
camera.SetViewUp(0, 0, 1)
camera.SetViewAngle(30)


def frame():
    """Seconds, and the pixels."""
    renderer.ResetCameraClippingRange()
    pixels = vtk.vtkUnsignedCharArray()
    start = time.perf_counter()
    window.Render()
    window.GetPixelData(0, 0, SIDE - 1, SIDE - 1, 1, pixels, 0)
    return time.perf_counter() - start, vtk_to_numpy(pixels).reshape(SIDE, SIDE, 3)[::-1]


frame()
frame()[1].tofile(sys.argv[6])
times = []
for _ in range(FRAMES):
    camera.Azimuth(360 / FRAMES)
    times.append(frame()[0])
print(json.dumps(statistics.median(times)))
