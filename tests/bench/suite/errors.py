"""Time against error beside brute force with Embree, on every scene."""
import json
import subprocess
import sys

from suite import figures, page, scenes
from suite.common import BIN, RESULTS, build, load, save_report, version


def measure(name, threads, runs, edge, *more):
    """bench_error's report on one scene."""
    out = RESULTS / "errors" / f"{name}-{threads}.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    scene = scenes.write(name, RESULTS / "scenes")
    command = [BIN / "bench_error", scene, "--references", RESULTS / "references", "--json", out, "--threads", threads, "--runs", runs,
               "--edge", edge, *more]
    if subprocess.run([*map(str, command)]).returncode not in (0, 1):
        sys.exit(f"bench_error failed on {name}")
    return json.loads(out.read_text())


def errors(names=None, thread_counts=(1, 2), runs=5, edge=None, target=1e-3, is_continued=False):
    """`edge` of all pictures, if not each scene's own. Continued, it leaves out what this version has been measured on."""
    build("bench_error")
    for name in names or scenes.SCENES:
        for threads in thread_counts:
            what = {"version": version(), "edge": edge or scenes.EDGES.get(name, scenes.EDGE), "runs": runs, "target": target}
            if is_continued and any(what.items() <= r.items() for r in load("errors") or [] if (r["scene"], r["threads"]) == (name, threads)):
                continue
            report = measure(name, threads, runs, what["edge"], "--target", target, "--patience", scenes.PATIENCE.get(name, 30))
            save_report("errors", report | what)
    show()
    differing = [f"{r['scene']} of {each['name']}" for r in load("errors") for each in r["renderers"] if not each.get("agrees", True)]
    if differing:
        sys.exit(f"Not the reference's picture: {', '.join(differing)}")


def show():
    reports = load("errors") or []
    if reports:
        figures.error_table(reports)
        page.print_ratios(reports)
        print(f"\nplots: {page.write(reports)}")
