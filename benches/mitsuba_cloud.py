"""Mitsuba 3's volpath: one scene, one JSON line with its mean, RMSE and time.

Usage: mitsuba_cloud.py SCENE SAMPLES RENDERS; SCENE is cloud (a grid of 64 voxels a side) or cube (homogeneous). The RMSE is that of
the renders' spread, pixel by pixel, which needs no reference.
"""
import glob
import json
import os
import statistics
import sys
import time

for library in sorted(glob.glob("/usr/lib/*/libLLVM.so.1[6-9]*")) + sorted(glob.glob("/usr/lib/*/libLLVM-1[6-9].so.1")):
    os.environ.setdefault("DRJIT_LIBLLVM_PATH", library)
import mitsuba as mi
import numpy as np

mi.set_variant("llvm_ad_rgb")
name, samples, renders = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
place = mi.ScalarTransform4f


def grey(value):
    return {"type": "rgb", "value": [value] * 3}


def medium():
    isotropic = {"type": "isotropic"}
    if name == "cube":
        return {"type": "homogeneous", "sigma_t": grey(1.0), "albedo": grey(0.9), "scale": 2.0, "phase": isotropic}
    at = (np.arange(64) + 0.5) / 32 - 1
    z, y, x = np.meshgrid(at, at, at, indexing="ij")
    density = np.exp(-4 * (x * x + y * y + z * z)) * (0.6 + 0.4 * np.sin(14 * x) * np.sin(14 * y) * np.sin(14 * z))
    grid = mi.VolumeGrid(density.astype(np.float32)[..., None])
    sigma = {"type": "gridvolume", "grid": grid, "raw": True, "to_world": place().translate([-1, -1, -1]).scale(2.0)}
    return {"type": "heterogeneous", "sigma_t": sigma, "albedo": {"type": "constvolume", "value": grey(0.9)}, "scale": 20.0, "phase": isotropic}


film = {"type": "hdrfilm", "width": 256, "height": 256, "pixel_format": "rgb", "rfilter": {"type": "box"}}
view = place().look_at(origin=[2.6, -3.0, 2.2], target=[0, 0, 0], up=[0, 0, 1])
scene = mi.load_dict({
    "type": "scene", "integrator": {"type": "volpath"},
    "sensor": {"type": "perspective", "fov": 40, "to_world": view, "film": film, "sampler": {"type": "independent"}},
    "sun": {"type": "directional", "direction": [-0.5, 0.6, -0.8], "irradiance": grey(3.0)},
    "sky": {"type": "constant", "radiance": grey(0.3)},
    "cube": {"type": "cube", "bsdf": {"type": "null"}, "interior": medium()},
})
np.array(mi.render(scene, spp=samples, seed=1000))
times, pictures = [], []
for seed in range(renders):
    start = time.perf_counter()
    pictures.append(np.array(mi.render(scene, spp=samples, seed=seed), dtype=np.float64))
    times.append(time.perf_counter() - start)
pictures = np.array(pictures)
means = pictures.mean(axis=(1, 2, 3))
print(json.dumps({
    "mean": means.mean(), "mean_error": means.std(ddof=1) / renders**0.5,
    "rmse": float(np.sqrt(pictures.var(axis=0, ddof=1).mean())), "seconds": statistics.median(times),
}))
