"""VTK's CPU ray caster on the synthetic 256^3 volume: 512x512, spinning camera, one voxel a step, all threads.

Usage: vtk_synth.py VOLUME.raw FRAMES MODE; MODE is composite, shaded, maximum or isosurface. One JSON line: seconds per frame.
"""
import json
import statistics
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

N, SIDE, FRAMES, MODE = 256, 512, int(sys.argv[2]), sys.argv[3]
voxels = np.fromfile(sys.argv[1], np.uint8)
step = 2 / N
image = vtk.vtkImageData()
image.SetDimensions(N, N, N)
image.SetSpacing(step, step, step)
image.SetOrigin(*(-(N - 1) * step / 2,) * 3)
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
camera.SetPosition(0, -3.6, 1.2)
camera.SetFocalPoint(0, 0, 0)
camera.SetViewUp(0, 0, 1)
camera.SetViewAngle(30)
times, pixels = [], vtk.vtkUnsignedCharArray()
for i in range(FRAMES + 1):
    camera.Azimuth(360 / FRAMES)
    renderer.ResetCameraClippingRange()
    start = time.perf_counter()
    window.Render()
    window.GetPixelData(0, 0, SIDE - 1, SIDE - 1, 1, pixels, 0)
    times.append(time.perf_counter() - start)
print(json.dumps(statistics.median(times[1:])))
