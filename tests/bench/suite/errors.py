"""Time against error beside brute force with Embree, on every scene."""
import itertools
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


def is_measured(name, threads, what):
    """Whether the report of that scene is there, of this very version."""
    known = [r for r in load("errors") or [] if (r["scene"], r["threads"]) == (name, threads)]
    return not what["version"].endswith("-dirty") and any(what.items() <= r.items() for r in known)


def errors(names=None, thread_counts=(1, 2), runs=5, edge=None, target=1e-3, is_continued=False):
    """`edge` of all pictures, if not each scene's own. Continued, it leaves out what this version was measured on."""
    build("bench_error")
    differing = []
    for name, threads in itertools.product(names or scenes.SCENES, thread_counts):
        what = {"version": version(), "edge": edge or scenes.EDGES.get(name, scenes.EDGE), "runs": runs, "target": target}
        if is_continued and is_measured(name, threads, what):
            continue
        report = measure(name, threads, runs, what["edge"], "--target", target, "--patience", scenes.PATIENCE.get(name, 30))
        save_report("errors", report | what)
        differing += [f"{name} of {renderer['name']}" for renderer in report["renderers"] if not renderer["agrees"]]
    show()
    if differing:
        sys.exit(f"Not the reference's picture: {', '.join(differing)}")


def show():
    reports = load("errors") or []
    if reports:
        figures.error_table(reports)
        page.print_ratios(reports)
        print(f"\nplots: {page.write(reports)}")
