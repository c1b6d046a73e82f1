"""Equal rays and builds: Penumbra's single-ray calls beside Embree's."""
import json

from suite import scenes
from suite.common import RESULTS, build, run_program, save

SCENES = ["bunny-1", "sphereflake", "mount"]


def rays(runs=7):
    build("bench_rays")
    figures = []
    for name in SCENES:
        out = RESULTS / "rays" / f"{name}.json"
        out.parent.mkdir(parents=True, exist_ok=True)
        run_program("bench_rays", scenes.write(name, RESULTS / "scenes"), "--runs", runs, "--json", out)
        figures.append(json.loads(out.read_text()))
    save("rays", figures)
