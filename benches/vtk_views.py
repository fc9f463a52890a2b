"""VTK's CPU ray caster on a volume of bytes around the origin: 512x512, spinning camera, one voxel a step, all threads.

Usage: vtk_views.py VOLUME.raw NX,NY,NZ SX,SY,SZ DISTANCE FRAMES MODE [OUT]; MODE is composite, shaded, maximum or isosurface. The camera starts at
(0, -DISTANCE, DISTANCE / 3); the picture from there is written to OUT, R, G, B bytes from the top. One JSON line: seconds per frame, the median.
"""
import json
import statistics
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

SIDE, DISTANCE, FRAMES, MODE = 512, float(sys.argv[4]), int(sys.argv[5]), sys.argv[6]
voxels = np.fromfile(sys.argv[1], np.uint8)
dims, spacing = [int(n) for n in sys.argv[2].split(",")], [float(s) for s in sys.argv[3].split(",")]
step = min(spacing)
image = vtk.vtkImageData()
image.SetDimensions(*dims)
image.SetSpacing(*spacing)
image.SetOrigin(*(-(n - 1) * s / 2 for n, s in zip(dims, spacing)))
image.GetPointData().SetScalars(numpy_to_vtk(voxels, deep=True))

mapper = vtk.vtkFixedPointVolumeRayCastMapper()
mapper.SetInputData(image)
mapper.SetAutoAdjustSampleDistances(0)
mapper.SetImageSampleDistance(1.0)
mapper.SetSampleDistance(step)
mapper.SetInteractiveSampleDistance(step)
if MODE == "maximum":
    mapper.SetBlendModeToMaximumIntensity()
else:
    mapper.SetBlendModeToComposite()
look = vtk.vtkVolumeProperty()
colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
for value, rgb in ((5, (0.1, 0.1, 0.6)), (130, (0.9, 0.5, 0.2)), (255, (1, 1, 0.9))):
    colour.AddRGBPoint(value, *rgb)
if MODE == "isosurface":
    for value, alpha in ((5, 0), (74.5, 0), (76.5, 1), (255, 1)):
        opacity.AddPoint(value, alpha)
else:
    opacity.AddPoint(5, 0.0)
    opacity.AddPoint(255, 0.6)
look.SetColor(colour)
look.SetScalarOpacity(opacity)
look.SetScalarOpacityUnitDistance(4 * step)
look.SetInterpolationTypeToLinear()
if MODE in ("shaded", "isosurface"):
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
camera.SetPosition(0, -DISTANCE, DISTANCE / 3)
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


_, first = frame()
if len(sys.argv) > 7:
    first.tofile(sys.argv[7])
times = []
for _ in range(FRAMES):
    camera.Azimuth(360 / FRAMES)
    times.append(frame()[0])
print(json.dumps(statistics.median(times)))
