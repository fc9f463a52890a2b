"""MCX's OpenCL version on PoCL: one scene, one JSON line with photons per ms (kernel and wall) and the absorbed fraction.

Usage: mcx_photons.py SCENE PHOTONS; SCENE is cube60, cube60b or spheres.
"""
import json
import os
import sys
import time

import pyopencl

# The platform must be open before pmcxcl is imported: its wheel brings a C++ library that PoCL's compiler cannot live with.
pyopencl.get_platforms()[0].get_devices()
import numpy as np
import pmcxcl
from pmcxcl import bench

scene, photons = sys.argv[1], int(sys.argv[2])
if scene == "spheres":
    distance = np.sqrt(((np.indices((60, 60, 60)) - 29.5) ** 2).sum(0))
    labels = np.ones((60, 60, 60), np.uint8)
    for radius, label in ((25, 2), (23, 3), (10, 4)):
        labels[distance < radius] = label
    media = [[0, 0, 1, 1], [0.02, 7, 0.89, 1.37], [0.004, 0.009, 0.89, 1.37], [0.02, 9, 0.89, 1.37], [0.05, 0.5, 0.9, 1.37]]
    request = dict(vol=labels, prop=media, tstart=0, tend=5e-9, tstep=5e-9, srcpos=[30, 30.1, 0], srcdir=[0, 0, 1], isreflect=1, issrcfrom0=1)
else:
    request = dict(bench[scene])
    request.pop("detpos", None)
request.update(gpuid=1, issavedet=0)


def run(n):
    out, null = os.dup(1), os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    try:
        start = time.perf_counter()
        result = pmcxcl.run(dict(request, nphoton=n))
        return result["stat"], time.perf_counter() - start
    finally:
        os.dup2(out, 1)


run(1000)
stat, wall = run(photons)
print(json.dumps({"kernel": photons / stat["runtime"], "wall": photons / wall / 1e3, "absorbed": stat["energyabs"] / stat["energytot"]}))
