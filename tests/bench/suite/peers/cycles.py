"""Blender's Cycles 3.4: direct light only. Its point lights are the contract's discs, but each sample is lit from its own place
on the disc, so its limit is close to the exact image and not the same."""
import json
import os
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from suite.peers import NotExpressible

FIXED = [4, 16, 64, 256]
THRESHOLDS = [0.1, 0.03, 0.01, 0.003]
MOST_SAMPLES = 1024  # of adaptive sampling
IS_RANDOM = True
SCRIPT = Path(__file__).with_name("cycles_scene.py")


def check(scene):
    for light in scene["lights"]:
        if light["type"] != "point" or light.get("attenuation", [1, 0, 0]) != [1, 0, 0]:
            raise NotExpressible("attenuation")
    if "vertical_fov" not in scene["camera"]:
        raise NotExpressible("view plane")
    for shape in scene["objects"]:
        if shape["type"] not in ("mesh", "sphere"):
            raise NotExpressible(shape["type"])
        if "normals" in shape:
            raise NotExpressible("smooth normals")
        material = shape.get("material", {})
        material = scene["materials"][material] if isinstance(material, str) else material
        for key in ("specular", "reflection", "transmission"):
            if np.any(material.get(key, 0)):
                raise NotExpressible(key)


def clock(text):
    """Seconds of 00:01.25 or 01:02:03.25."""
    return sum(float(part) * 60 ** i for i, part in enumerate(reversed(text.split(":"))))


def render(scene, samples, threshold, threads, edge, seed=0):
    """The linear image and the seconds of sampling, from the times of Blender's first and last report on samples."""
    with tempfile.TemporaryDirectory() as folder:
        job, image = Path(folder) / "job.json", Path(folder) / "image"
        job.write_text(json.dumps({"scene": scene, "edge": edge, "threads": threads, "samples": samples, "threshold": threshold,
                                   "seed": seed, "image": str(image)}))
        report = subprocess.run(["blender", "-b", "--factory-startup", "-t", str(threads), "-P", str(SCRIPT), "--", str(job)],
                                capture_output=True, text=True)
        if not image.is_file():
            raise RuntimeError((report.stdout + report.stderr)[-2000:])
        times = [clock(t) for t in re.findall(r"Time:([\d:.]+) .*Sample \d+/\d+", report.stdout)]
        end = [clock(t) for t in re.findall(r"Time:([\d:.]+) .*Finished", report.stdout)]
        return np.fromfile(image, np.float32).reshape(edge, edge, 3).astype(float), (end or times)[-1] - times[0]


def variants(scene):
    """name → (budgets, render(budget, threads, edge))."""
    check(scene)
    return {"cycles fixed": (FIXED, lambda samples, threads, edge: render(scene, samples, None, threads, edge)),
            "cycles adaptive": (THRESHOLDS, lambda limit, threads, edge: render(scene, MOST_SAMPLES, limit, threads, edge))}


def finest_budget(coarsest=None):
    return FIXED[:coarsest][-1]


def finest(scene, coarsest, edge):
    """The images its limit is the mean of, with other seeds than the measured ones."""
    return [render(scene, finest_budget(coarsest), None, os.cpu_count(), edge, seed)[0] for seed in (1, 2)]
