"""Time against error beside brute force with Embree, on every scene."""
import json

from suite import figures, scenes
from suite.common import RESULTS, build, load, run_program, save_report


def measure(name, threads, runs, edge, *more):
    """bench_error's report on one scene."""
    out = RESULTS / "errors" / f"{name}-{threads}.json"
    out.parent.mkdir(parents=True, exist_ok=True)
    run_program("bench_error", scenes.write(name, RESULTS / "scenes"), "--references", RESULTS / "references", "--json", out,
                "--threads", threads, "--runs", runs, "--edge", edge, *more)
    return json.loads(out.read_text())


def errors(names=None, thread_counts=(1, 2), runs=5, edge=scenes.EDGE, target=1e-3):
    build("bench_error")
    for name in names or scenes.SCENES:
        for threads in thread_counts:
            save_report("errors", measure(name, threads, runs, edge, "--target", target))
    show()


def show():
    reports = load("errors") or []
    if reports:
        figures.error_table(reports)
        for report in reports:
            figures.plot(report)
