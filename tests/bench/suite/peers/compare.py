"""Penumbra beside POV-Ray and Cycles: every scene they can express, the same picture, their own clocks."""
import math
import shutil

import numpy as np

from suite import figures, scenes
from suite.common import RESULTS, build, load, print_table, save_report
from suite.errors import measure
from suite.peers import NotExpressible, cycles, povray

FAMILIES = {"povray": povray, "cycles": cycles}
PROGRAMS = {"povray": "povray", "cycles": "blender"}
MOST_RUNS, RUN_SECONDS = 5, 30  # a budget is repeated that often or that long
FAR = 25  # times what Penumbra needs for the target: a budget beyond is measured once, and no finer one after it


def reference(name, edge):
    """The exact image bench_error keeps: a double (its own squared error), then floats."""
    data = (RESULTS / "references" / f"{name}-{edge}.bin").read_bytes()
    return np.frombuffer(data, np.float32, offset=8).reshape(edge, edge, 3).astype(float)


def clamped(image):
    return np.clip(image, 0, 1)


def rmse(image, exact):
    return float(np.sqrt(np.mean((clamped(image) - clamped(exact)) ** 2)))


def measure_variant(render, budgets, threads, edge, most_runs, far_s):
    """[(budget, images, seconds)], from coarse to fine."""
    done = []
    for budget in budgets:
        images, seconds = [], []
        while len(images) < most_runs and (not seconds or sum(seconds) < RUN_SECONDS and seconds[0] < far_s):
            image, time = render(budget, threads, edge)
            images.append(image)
            seconds.append(time)
        done.append((budget, images, seconds))
        if seconds[0] >= far_s:
            break
    return done


def limit_of(family, name, scene, edge, coarsest):
    """What the peer's images tend to – the mean of its finest ones, rendered once and kept – and the RMSE of that mean,
    as far as it is known."""
    module = FAMILIES[family]
    path = RESULTS / "references" / f"{name}-{edge}-{family}-{module.finest_budget(coarsest)}.npy"
    if not path.is_file():
        np.save(path, np.array([clamped(image) for image in module.finest(scene, coarsest, edge)], np.float32))
    images = np.load(path).astype(float)
    return images.mean(axis=0), rmse(images[0], images[1]) / 2 if module.IS_RANDOM else 0


def family_report(family, name, scene, threads, edge, most_runs, coarsest, far_s):
    """The renderers of one peer with their errors, against the exact image and against the peer's own limit."""
    exact = reference(name, edge)
    limit, limit_noise = limit_of(family, name, scene, edge, coarsest)
    renderers = []
    for variant, (budgets, render) in FAMILIES[family].variants(scene).items():
        measured = measure_variant(render, budgets[:coarsest], threads, edge, most_runs, far_s)
        renderers.append({"name": variant, "is_cut": len(measured) < len(budgets), "budgets": [
            {"samples": budget, "seconds": seconds, "rmse": [rmse(i, exact) for i in images],
             "rmse_limit": [max(0, rmse(i, limit) ** 2 - limit_noise ** 2) ** 0.5 for i in images]}
            for budget, images, seconds in measured]})
    return {"renderers": renderers, "limit_rmse": max(0, rmse(limit, exact) ** 2 - limit_noise ** 2) ** 0.5}


def peers(names=None, thread_counts=(1, 2), edge=scenes.EDGE, most_runs=MOST_RUNS, coarsest=None, target=1e-3):
    build("bench_error")
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
                if not report:
                    report = measure(name, threads, most_runs, edge, "--only", "penumbra", "--target", target)
                    own_s = figures.time_at(target, figures.points(figures.budgets_of(report, "penumbra")))
                    far_s = math.inf if own_s is None else FAR * own_s
                report[family] = family_report(family, name, scene, threads, edge, most_runs, coarsest, far_s)
            if report:
                save_report("peers", report)
    show()


def time_or_bound(renderers, error, target):
    """(seconds, "", variant) of the variant that reaches the error first, or (seconds, ">", variant): none had reached it
    when the first that does not was cut off. Where none was cut off either, the finest budget of all has not."""
    curves = {r["name"]: figures.points(r["budgets"], error) for r in renderers}
    reached = [(time, "", name) for name, curve in curves.items() if (time := figures.time_at(target, curve)) is not None]
    cut = [(curves[r["name"]][-1][1], ">", r["name"]) for r in renderers
           if r["is_cut"] and figures.time_at(target, curves[r["name"]]) is None]
    if reached or cut:
        return min(reached + cut)
    return max((curve[-1][1], ">", name) for name, curve in curves.items())


def row(report, family, target, error):
    """Penumbra beside the variant of the family that gets there first."""
    penumbra = figures.time_at(target, figures.points(figures.budgets_of(report, "penumbra")))
    seconds, sign, name = time_or_bound(report[family]["renderers"], error, target)
    ratio = "-" if penumbra is None else f"{sign}{seconds / penumbra:.0f}"
    return (report["scene"], report["threads"], f"{target:.0e}", figures.seconds_text(penumbra), f"{sign}{seconds:.2f}", name, ratio)


def show():
    reports = load("peers") or []
    for family in FAMILIES:
        having = [r for r in reports if family in r]
        if not having:
            continue
        head = ("scene", "threads", "RMSE", "Penumbra s", f"{family} s", "variant", "times faster")
        for error, title in (("rmse", "against the exact image"), ("rmse_limit", "against its own limit")):
            rows = [head] + [row(r, family, target, error) for r in having for target in figures.TARGETS]
            print_table(f"Time at equal RMSE, {family} {title} (> : what was measured does not get there)", rows)
        print_table(f"RMSE of {family}'s limit against the exact image",
                    [("scene", "RMSE"), *dict.fromkeys((r["scene"], f"{r[family]['limit_rmse']:.1e}") for r in having)])
    embree = {(r["scene"], r["threads"]): r for r in load("errors") or []}
    for report in reports:
        base = embree.get((report["scene"], report["threads"]), report)
        figures.plot(base, [r for family in FAMILIES if family in report for r in report[family]["renderers"]])
