"""Points called lit or dark for certain, against 4,096 rays each, on every scene."""
import json
import subprocess
import sys

from suite import scenes
from suite.common import BIN, RESULTS, build, load, print_table, save

GRIDS = {"lights-1000": 8}  # where every point has many lights


def points(names=None, grid=64):
    build("bench_points")
    lines = []
    for name in names or scenes.SCENES:
        done = subprocess.run([BIN / "bench_points", scenes.write(name, RESULTS / "scenes"), "--grid", str(GRIDS.get(name, grid))],
                              capture_output=True, text=True)
        if done.returncode not in (0, 1):
            sys.exit(done.stderr)
        lines.append(json.loads(done.stdout))
        save("points", lines)
    show(lines)
    if any(line["wrong"] for line in lines):
        sys.exit("Points are called lit or dark that are not")


def show(lines=None):
    lines = lines or load("points") or []
    if lines:
        print_table(f"Points and lights: what is lit or dark for certain, against {lines[0]['rays']} rays each",
                    [("scene", "lit", "dark", "in a penumbra", "wrong"),
                     *((l["scene"], l["lit"], l["dark"], l["partial"], l["wrong"]) for l in lines)])
