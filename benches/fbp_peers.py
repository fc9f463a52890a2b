"""Filtered backprojection by scikit-image and ASTRA on the CPU: the head, views and grid of benches/tomography.rs. Prints rows of its table.

A package that is not there is left out. Times are medians of three on all threads, for which neither uses more than one here.
"""
import time

import numpy as np

SIDE, VIEWS, BINS = 512, 360, 729
# Grey, half sizes, centre, turn in degrees: the modified table with the ellipse IX at y = -0.605.
HEAD = [
    (1, 0.69, 0.92, 0, 0, 0), (-0.8, 0.6624, 0.874, 0, -0.0184, 0), (-0.2, 0.11, 0.31, 0.22, 0, -18), (-0.2, 0.16, 0.41, -0.22, 0, 18),
    (0.1, 0.21, 0.25, 0, 0.35, 0), (0.1, 0.046, 0.046, 0, 0.1, 0), (0.1, 0.046, 0.046, 0, -0.1, 0), (0.1, 0.046, 0.023, -0.08, -0.605, 0),
    (0.1, 0.023, 0.023, 0, -0.605, 0), (0.1, 0.023, 0.046, 0.06, -0.605, 0),
]
angles = np.arange(VIEWS) * np.pi / VIEWS
bins = (np.arange(BINS) - (BINS - 1) / 2) * 2 / SIDE


def head():
    fine = (np.arange(4 * SIDE) + 0.5) / (2 * SIDE) - 1
    x, y = np.meshgrid(fine, -fine)
    values = np.zeros_like(x)
    for grey, a, b, cx, cy, turn in HEAD:
        t = np.radians(turn)
        u, v = (x - cx) * np.cos(t) + (y - cy) * np.sin(t), (y - cy) * np.cos(t) - (x - cx) * np.sin(t)
        values += grey * ((u / a) ** 2 + (v / b) ** 2 <= 1)
    return values.reshape(SIDE, 4, SIDE, 4).mean((1, 3))


def sinogram():
    values = np.zeros((VIEWS, BINS))
    for grey, a, b, cx, cy, turn in HEAD:
        t = angles[:, None] - np.radians(turn)
        reach = (a * np.cos(t)) ** 2 + (b * np.sin(t)) ** 2
        off = bins - cx * np.cos(angles[:, None]) - cy * np.sin(angles[:, None])
        values += 2 * grey * a * b * np.sqrt(np.maximum(reach - off**2, 0)) / reach
    return values


truth, data = head(), sinogram()
centres = (np.arange(SIDE) + 0.5) / SIDE * 2 - 1
inside = centres[:, None] ** 2 + centres**2 < 1


def report(name, run):
    times = []
    for _ in range(3):
        begun = time.perf_counter()
        found = run()
        times.append(1e3 * (time.perf_counter() - begun))
    error = min(np.sqrt(np.mean((image - truth)[inside] ** 2)) for image in (found, found[::-1]))
    print(f"| {name} | {sorted(times)[1]:.0f} | – | {error:.4f} |")


try:
    import skimage
    from skimage.transform import iradon

    wide = data.T * SIDE / 2
    report(f"scikit-image {skimage.__version__}", lambda: iradon(wide, np.degrees(angles), output_size=SIDE, filter_name="ramp", circle=False))
except ImportError:
    pass

try:
    import astra

    volume, rays = astra.create_vol_geom(SIDE, SIDE), astra.create_proj_geom("parallel", 1.0, BINS, angles)
    projector = astra.create_projector("linear", rays, volume)

    def fbp():
        views, image = astra.data2d.create("-sino", rays, (data * SIDE / 2).astype(np.float32)), astra.data2d.create("-vol", volume)
        settings = astra.astra_dict("FBP") | {"ReconstructionDataId": image, "ProjectionDataId": views, "ProjectorId": projector}
        algorithm = astra.algorithm.create(settings)
        astra.algorithm.run(algorithm)
        found = astra.data2d.get(image)
        astra.algorithm.delete(algorithm)
        astra.data2d.delete([views, image])
        return found

    report(f"ASTRA {astra.__version__}", fbp)
except ImportError:
    pass
