"""Equal rays and builds: Penumbra's single-ray calls beside Embree's."""
import json

from suite import scenes
from suite.common import RESULTS, build, load, print_table, run_program, save
from suite.figures import spread

SCENES = ["bunny-1", "sphereflake", "mount"]


def rays(names=SCENES, runs=7):
    build("bench_rays")
    reports = []
    for name in names:
        out = RESULTS / "rays" / f"{name}.json"
        out.parent.mkdir(parents=True, exist_ok=True)
        run_program("bench_rays", scenes.write(name, RESULTS / "scenes"), "--runs", runs, "--json", out)
        reports.append(json.loads(out.read_text()))
    save("rays", reports)
    show(reports)


def show(reports=None):
    reports = reports or load("rays") or []
    if not reports:
        return
    ratios = lambda a, b: [x / y for x, y in zip(a, b)]
    rows = [("scene", "rays", "threads", "Penumbra Mrays/s", "Embree", "robust", "Penumbra / Embree", "/ robust", "hits that differ")]
    builds = [("scene", "threads", "Penumbra ms", "Embree ms", "Penumbra / Embree")]
    for report in reports:
        for r in report["rays"]:
            rates = r["mrays"]
            rows.append((report["scene"], r["rays"], r["threads"],
                         *(spread(rates[n], "{:.2f}") for n in ("penumbra", "embree", "embree robust")),
                         spread(ratios(rates["penumbra"], rates["embree"]), "{:.2f}"),
                         spread(ratios(rates["penumbra"], rates["embree robust"]), "{:.2f}"),
                         f"{r['differing_default']} / {r['differing_robust']} of {r['count']}"))
        for b in report["builds"]:
            builds.append((report["scene"], b["threads"], spread(b["penumbra_ms"]), spread(b["embree_ms"]),
                           spread(ratios(b["penumbra_ms"], b["embree_ms"]), "{:.2f}")))
    print_table("Equal rays, single-ray calls (median, least–most)", rows)
    print_table("Builds: Penumbra's compile beside Embree's high-quality build", builds)
