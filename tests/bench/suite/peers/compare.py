"""Penumbra beside POV-Ray and Cycles: every scene they can express, the same picture, their own clocks."""
import shutil
import statistics

import numpy as np

from suite import figures, scenes
from suite.common import RESULTS, build, load, print_table, save
from suite.errors import measure
from suite.peers import NotExpressible, cycles, povray

FAMILIES = {"povray": povray, "cycles": cycles}
PROGRAMS = {"povray": "povray", "cycles": "blender"}
MOST_RUNS, RUN_SECONDS = 5, 30  # a budget is repeated that often or that long
STOP_SECONDS = 60               # a variant's next budget is left out once one takes this long


def reference(name, edge):
    """The exact image bench_error keeps: a double (its own squared error), then floats."""
    data = (RESULTS / "references" / f"{name}-{edge}.bin").read_bytes()
    return np.frombuffer(data, np.float32, offset=8).reshape(edge, edge, 3).astype(float)


def clamped(image):
    return np.clip(image, 0, 1)


def rmse(image, exact):
    return float(np.sqrt(np.mean((clamped(image) - clamped(exact)) ** 2)))


def measure_variant(render, budgets, threads, edge, most_runs):
    """[(budget, images, seconds)], from coarse to fine."""
    done = []
    for budget in budgets:
        images, seconds = [], []
        while len(images) < most_runs and (not seconds or sum(seconds) < RUN_SECONDS):
            image, time = render(budget, threads, edge)
            images.append(image)
            seconds.append(time)
        done.append((budget, images, seconds))
        if statistics.median(seconds) > STOP_SECONDS:
            break
    return done


def family_report(family, scene, exact, threads, edge, most_runs, coarsest):
    """The renderers of one peer with their errors, against the exact image and against the peer's own limit: the mean of
    its finest images."""
    measured = {name: measure_variant(render, budgets[:coarsest], threads, edge, most_runs)
                for name, (budgets, render) in family.variants(scene).items()}
    limit = np.mean([clamped(variant[-1][1][0]) for variant in measured.values()], axis=0)
    renderers = []
    for name, variant in measured.items():
        renderers.append({"name": name, "budgets": [
            {"samples": budget, "seconds": seconds, "rmse": [rmse(i, exact) for i in images],
             "rmse_limit": [rmse(i, limit) for i in images]} for budget, images, seconds in variant]})
    return {"renderers": renderers, "limit_rmse": rmse(limit, exact)}


def peers(names=None, thread_counts=(1, 2), edge=scenes.EDGE, most_runs=MOST_RUNS, coarsest=None, target=1e-3):
    build("bench_error")
    reports = []
    for name in names or scenes.SCENES:
        scene = scenes.body_of(name)["scene"]
        for threads in thread_counts:
            report = None
            for family, module in FAMILIES.items():
                if not shutil.which(PROGRAMS[family]):
                    print(f"{PROGRAMS[family]} is not installed")
                    continue
                try:
                    module.variants(scene)
                except NotExpressible as reason:
                    print(f"{family} cannot express {name}: {reason}")
                    continue
                report = report or measure(name, threads, most_runs, edge, "--only", "penumbra", "--target", target)
                report[family] = family_report(module, scene, reference(name, edge), threads, edge, most_runs, coarsest)
            if report:
                reports.append(report)
                save("peers", reports)
    show(reports)


def at_least(curve, target):
    """The time to reach an error, or a bound from below where the finest budget does not."""
    seconds = figures.time_at(target, curve)
    return (seconds, "") if seconds is not None else (curve[-1][1], ">")


def row(report, family, target, error):
    """Penumbra beside the variant of the family that gets there first."""
    penumbra = figures.time_at(target, figures.points(figures.budgets_of(report, "penumbra")))
    found = []
    for renderer in report[family]["renderers"]:
        seconds, sign = at_least(figures.points(renderer["budgets"], error), target)
        found.append((sign == ">", seconds if not sign else -seconds, sign, renderer["name"]))
    _, seconds, sign, name = min(found)
    seconds = abs(seconds)
    ratio = "-" if penumbra is None else f"{sign}{seconds / penumbra:.0f}"
    return (report["scene"], report["threads"], f"{target:.0e}", figures.seconds_text(penumbra), f"{sign}{seconds:.2f}", name, ratio)


def show(reports=None):
    reports = reports or load("peers") or []
    for family in FAMILIES:
        having = [r for r in reports if family in r]
        if not having:
            continue
        head = ("scene", "threads", "RMSE", "Penumbra s", f"{family} s", "variant", "times faster")
        for error, title in (("rmse", "against the exact image"), ("rmse_limit", "against its own limit")):
            rows = [head] + [row(r, family, target, error) for r in having for target in figures.TARGETS]
            print_table(f"Time at equal RMSE, {family} {title} (> : its finest budget does not get there)", rows)
        print_table(f"RMSE of {family}'s limit against the exact image",
                    [("scene", "RMSE")] + [(r["scene"], f"{r[family]['limit_rmse']:.1e}") for r in having])
    embree = {(r["scene"], r["threads"]): r for r in load("errors") or []}
    for report in reports:
        base = embree.get((report["scene"], report["threads"]), report)
        figures.plot(base, [r for family in FAMILIES if family in report for r in report[family]["renderers"]])
