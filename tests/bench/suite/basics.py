"""Penumbra alone: beside the ray tracer it replaces, what the server adds, and how long a build takes."""
import http.client
import json
import os
import shutil
import statistics
import subprocess
import tempfile
import time
from pathlib import Path

from suite.common import BIN, ROOT, print_table

SCENES = ROOT / "tests/support/predecessor"
RUNS = 5


def render_seconds(scene, **options):
    """Build + render time of one run, from the program's own statistics."""
    with tempfile.TemporaryDirectory() as folder:
        stats = Path(folder) / "stats.json"
        command = [BIN / "penumbra", "render", SCENES / f"{scene}.json", "-o", Path(folder) / "image.png"]
        for name, value in options.items():
            command += ["--set", f"{name}={value}"]
        subprocess.run([*map(str, command), "--stats", str(stats)], check=True, stderr=subprocess.DEVNULL)
        figures = json.loads(stats.read_text())
    return figures["build_s"] + figures["render_s"]


def medians(variants):
    """Median seconds of each variant, run in turn so that a slow spell of the machine meets all of them."""
    samples = {name: [] for name in variants}
    for _ in range(RUNS):
        for name, (scene, options) in variants.items():
            samples[name].append(render_seconds(scene, **options))
    return {name: statistics.median(values) for name, values in samples.items()}


# Seconds of the Java ray tracer on a 2-core machine with 21 shadow rays a light (clients/scenes/README.md).
SEED = {
    "room-flat": {"none": 127.3, "cbr": 34.0, "median": 37.9, "median, serial": 71.3},
    "room-groups": {"groups": 22.7},
    "teapot": {"cbr": 11.5, "median": 1.19},
}


def seed():
    accelerations = ["none", "cbr", "groups", "median", "bvh"]
    slower = []
    for scene in ["room-flat", "room-groups", "teapot"]:
        variants = {a: (scene, {"acceleration": a, "threads": -1}) for a in accelerations}
        variants["median, serial"] = (scene, {"acceleration": "median", "threads": 0})
        variants["bvh, serial"] = (scene, {"acceleration": "bvh", "threads": 0})
        seconds = medians(variants)
        rows = [("acceleration", "Penumbra s", "predecessor s", "times faster", "x bvh")]
        for name, value in seconds.items():
            old = SEED[scene].get(name)
            base = seconds["bvh, serial" if name.endswith("serial") else "bvh"]
            rows.append((name, f"{value:.3f}", old if old else "-", f"{old / value:.0f}" if old else "-", f"{value / base:.2f}"))
            if value < 0.97 * base:
                slower.append(f"{scene}: {name}")
        print_table(f"{scene}: Penumbra with 64 shadow samples, the predecessor with 21 (median of {RUNS})", rows)
    print("\nbvh slower than another acceleration by more than 3 %:", ", ".join(slower) or "never")


def server():
    folder = tempfile.mkdtemp()
    process = subprocess.Popen([BIN / "penumbra", "serve", "--listen", "127.0.0.1:0", "--store", folder], stdout=subprocess.PIPE,
                               stderr=subprocess.DEVNULL, text=True)
    scene = {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40},
             "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
             "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1, "radius": 0.5}]}

    def times_of(connection, seeds):
        times = []
        for seed in seeds:
            body = json.dumps({"scene": scene, "options": {"width": 16, "height": 16, "seed": seed}})
            start = time.perf_counter()
            connection.request("POST", "/v1/render", body, {"Content-Type": "application/json"})
            response = connection.getresponse()
            image = response.read()
            times.append(1000 * (time.perf_counter() - start))
            assert response.status == 200 and image.startswith(b"\x89PNG"), response.status
        return sorted(times[20:])

    try:
        connection = http.client.HTTPConnection(process.stdout.readline().rsplit("http://", 1)[1].strip())
        fresh, found = times_of(connection, range(220)), times_of(connection, 220 * [0])
        print_table("POST /v1/render of a 16 x 16 job, kept connection, 200 requests",
                    [("", "median ms", "p99 ms")] +
                    [(name, f"{statistics.median(times):.2f}", f"{times[int(0.99 * len(times))]:.2f}")
                     for name, times in (("rendered and stored", fresh), ("found again", found))])
    finally:
        process.terminate()
        process.wait()
        shutil.rmtree(folder)


def build():
    folder = Path(tempfile.mkdtemp())
    try:
        environment = dict(os.environ, CCACHE_DISABLE="1")
        start = time.perf_counter()
        subprocess.run(["cmake", "-S", ROOT, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Release", "-DPENUMBRA_TESTS=OFF"],
                       check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["cmake", "--build", folder, "--target", "penumbra", "penumbra_image"], check=True,
                       stdout=subprocess.DEVNULL, env=environment)
        program = time.perf_counter() - start
        subprocess.run(["cmake", "-S", ROOT, "-B", folder, "-DPENUMBRA_TESTS=ON"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run(["cmake", "--build", folder], check=True, stdout=subprocess.DEVNULL, env=environment)
        print_table("build from nothing, no compiler cache",
                    [("", "s"), ("penumbra", f"{program:.0f}"), ("with all tests", f"{time.perf_counter() - start:.0f}")])
    finally:
        shutil.rmtree(folder)


def encode():
    subprocess.run([BIN / "test_engine", "--test-case=figures: encoding", "--no-skip", "--minimal"], check=True)


def start():
    with tempfile.TemporaryDirectory() as folder:
        command = [BIN / "penumbra", "render", SCENES / "light-sphere-point.json", "-o", Path(folder) / "image.png",
                   "--set", "width=64", "--set", "height=64"]
        times = []
        for _ in range(101):
            begin = time.perf_counter()
            subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
            times.append(1000 * (time.perf_counter() - begin))
    times.sort()
    print_table("penumbra render, 64 x 64, hard shadows, start to PNG, 101 runs",
                [("", "ms"), ("least", f"{times[0]:.1f}"), ("median", f"{times[50]:.1f}"), ("p90", f"{times[90]:.1f}")])
