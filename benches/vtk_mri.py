"""VTK's CPU ray caster on the MRI head: 512x512, spinning camera, one voxel a step, all threads. Prints seconds per frame.

Usage: vtk_mri.py VOLUME.nii.gz FRAMES; one JSON line: {"unshaded": s, "shaded": s}.
"""
import gzip
import json
import statistics
import sys
import time

import numpy as np
import vtk
from vtk.util.numpy_support import numpy_to_vtk

SIDE, FRAMES = 512, int(sys.argv[2])
raw = gzip.open(sys.argv[1]).read()
nx, ny, nz = (int(n) for n in np.frombuffer(raw, "<i2", 3, 42))
voxels = np.frombuffer(raw, np.uint8, nx * ny * nz, int(np.frombuffer(raw, "<f4", 1, 108)[0]))
image = vtk.vtkImageData()
image.SetDimensions(nx, ny, nz)
image.SetOrigin(-(nx - 1) / 2, -(ny - 1) / 2, -(nz - 1) / 2)
image.GetPointData().SetScalars(numpy_to_vtk(voxels, deep=True))


def frames(shaded):
    """Median seconds of a frame. The transfer function is the benchmark's: empty below 30, then a ramp to 0.15 per mm at 200."""
    mapper = vtk.vtkFixedPointVolumeRayCastMapper()
    mapper.SetInputData(image)
    mapper.SetAutoAdjustSampleDistances(0)
    mapper.SetImageSampleDistance(1.0)
    mapper.SetSampleDistance(1.0)
    mapper.SetInteractiveSampleDistance(1.0)
    mapper.SetBlendModeToComposite()
    look = vtk.vtkVolumeProperty()
    colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    colour.AddRGBPoint(30, 0.1, 0.1, 0.6)
    colour.AddRGBPoint(200, 1, 1, 0.9)
    opacity.AddPoint(30, 0.0)
    opacity.AddPoint(200, 1 - np.exp(-0.15))
    look.SetColor(colour)
    look.SetScalarOpacity(opacity)
    look.SetScalarOpacityUnitDistance(1.0)
    look.SetInterpolationTypeToLinear()
    look.ShadeOn() if shaded else look.ShadeOff()
    volume = vtk.vtkVolume()
    volume.SetMapper(mapper)
    volume.SetProperty(look)
    renderer, window = vtk.vtkRenderer(), vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(SIDE, SIDE)
    window.AddRenderer(renderer)
    renderer.AddVolume(volume)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(0, -390, 130)
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
    return statistics.median(times[1:])


print(json.dumps({"unshaded": frames(False), "shaded": frames(True)}))
