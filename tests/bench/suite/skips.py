"""What each part of the renderer that only saves time saves: time with and without it, its counter, the image's change."""
import json
import re
import statistics
import subprocess
import tempfile
from pathlib import Path

from suite import scenes
from suite.common import BIN, print_table, save

RUNS = 5
# The part, what it counts, scenes (of the benchmark, the predecessor, or clients/scenes) that have something to skip, and shadow
# samples, if not 64, or another option.
SKIPS = [
    ("shadow-candidates", "shadow_rays_lit", ["room-flat", "bunny-1", "sphereflake"]),
    ("shadow-outlines", "shadow_rays_covered", ["room-flat", "bunny-1", "sphereflake"]),
    ("light-cells", "shadow_rays_lit", ["room-flat", "bunny-1", "sphereflake", "light-triangles-many"]),
    ("camera-bundles", "camera_rays_bundled", ["room-flat", "sphereflake", "bunny-1"]),
    ("shadow-bundles", "shadow_rays_bundled", ["glass-and-mirrors"]),
    ("few-rays", "lights_from_few_rays", ["bunny-1", "sphereflake"], 4),
    ("shared-samples", "lights_from_neighbours", ["bunny-1", "mount"], 4),
    ("agreeing-rays", "shadow_rays_agreed", ["bunny-1", "sphereflake"], 4),
    ("hidden-spheres", "hidden_spheres", ["sphereflake", "thousand-spheres"]),
    ("lights-without-share", "lights_without_effect", ["room-flat", "light-triangles-spot"]),
    ("light-tree", "lights_culled", ["lights-1000"], 4),
    ("drawn-lights", "lights_from_drawn", ["lights-1000"], "target_error=0.01"),
    ("exact-area-lights", "area_samples_exact", ["cow"]),
    ("merge-lights", "merged_lights", ["room-flat"]),
    ("empty-tiles", "empty_tiles", ["bunny-1", "tetra", "teapot"]),
]


def render(job, image, samples, without=()):
    stats = image.with_suffix(".json")
    option = f"shadow_samples={samples}" if isinstance(samples, int) else samples
    command = [BIN / "penumbra", "render", job, "-o", image, "--set", "transfer=linear", "--set", option,
               "--stats", stats, *(word for part in without for word in ("--without", part))]
    subprocess.run([*map(str, command)], check=True, stderr=subprocess.DEVNULL)
    return json.loads(stats.read_text())


def job_file(scene, folder):
    if scene in scenes.SCENES:
        return scenes.write(scene, folder)
    old = scenes.ROOT / f"tests/support/predecessor/{scene}.json"
    return old if old.is_file() else scenes.ROOT / f"clients/scenes/{scene}.json"


def rms_difference(a, b):
    """By OpenImageIO's idiff, over unclamped linear values."""
    report = subprocess.run(["idiff", a, b], capture_output=True, text=True).stdout
    found = re.search(r"RMS error = ([0-9.e+-]+)", report)
    return 0.0 if "PASS" in report and not found else float(found.group(1))


def skips():
    rows = [("without", "scene", "on s", "off s", "off / on", "counter", "count", "rms difference", "estimated error")]
    table = []
    with tempfile.TemporaryDirectory() as folder:
        on_image, off_image = Path(folder) / "on.exr", Path(folder) / "off.exr"
        for part, counter, names, *samples in SKIPS:
            for scene in names:
                job = job_file(scene, folder)
                runs = [(render(job, on_image, *samples or [64]), render(job, off_image, *samples or [64], [part])) for _ in range(RUNS)]
                on, off = (statistics.median(run[which]["render_s"] for run in runs) for which in (0, 1))
                stats = runs[0][0]
                entry = {"without": part, "scene": scene, "on_s": on, "off_s": off, "counter": counter,
                         "count": stats["skipped"][counter], "rms_difference": rms_difference(on_image, off_image),
                         "estimated_error": stats["estimated_error"]}
                table.append(entry)
                rows.append((part, scene, f"{on:.3f}", f"{off:.3f}", f"{off / on:.2f}", counter, f"{entry['count']:,}",
                             f"{entry['rms_difference']:.1e}", f"{entry['estimated_error']:.1e}"))
    print_table(f"What is skipped, on two threads (medians of {RUNS}, in turn)", rows)
    save("skips", table)
