"""Time at equal error, tables and plots."""
import math
import statistics

from suite.common import RESULTS, print_table

TARGETS = [3e-2, 1e-2, 3e-3, 1e-3]


def points(budgets, error="rmse"):
    """(error, seconds) of each budget, medians over its runs, from coarse to fine."""
    return [(statistics.median(b[error]), statistics.median(b["seconds"])) for b in budgets]


def time_at(target, curve):
    """Seconds to reach an error, log-log between the two budgets around it; None where no budget does. Coarser than the
    cheapest budget costs as much as that one."""
    if not curve:
        return None
    best = math.inf
    for (error, seconds), previous in zip(curve, [None, *curve]):
        if error > target:
            continue
        if previous is None or previous[0] <= target or error <= 0:
            best = min(best, seconds)
            continue
        share = math.log(previous[0] / target) / math.log(previous[0] / error)
        best = min(best, math.exp((1 - share) * math.log(previous[1]) + share * math.log(seconds)))
    return best if best < math.inf else None


def run_curves(budgets):
    """The curve of each run by itself: its own seconds, the median error."""
    runs = max(len(b["seconds"]) for b in budgets)
    return [[(statistics.median(b["rmse"]), b["seconds"][i % len(b["seconds"])]) for b in budgets] for i in range(runs)]


def ratios_at(target, peer, report):
    """How many times faster Penumbra is at this error, run by run."""
    own = [run_curves(r["budgets"]) for r in penumbras(report)]
    pairs = [(time_at(target, a), soonest(target, [curves[i % len(curves)] for curves in own]))
             for i, a in enumerate(run_curves(peer))]
    return [a / b for a, b in pairs if a and b]


def penumbras(report):
    """Penumbra over its numbers of samples, and over its targets."""
    return [r for r in report["renderers"] if r["name"].startswith("penumbra") and r["budgets"]]


def soonest(target, curves):
    times = [time for time in (time_at(target, curve) for curve in curves) if time is not None]
    return min(times, default=None)


def spread(values, form="{:.1f}"):
    if not values:
        return "-"
    return f"{form.format(statistics.median(values))} ({form.format(min(values))}–{form.format(max(values))})"


def seconds_text(value):
    return "-" if value is None else f"{value:.3f}"


def budgets_of(report, name):
    return next((r["budgets"] for r in report["renderers"] if r["name"] == name), [])


def best_peer(target, report, prefix):
    """The renderer of that family which reaches the error first."""
    family = [r for r in report["renderers"] if r["name"].startswith(prefix)]
    timed = [(time_at(target, points(r["budgets"])), r["name"]) for r in family]
    timed = [each for each in timed if each[0] is not None]
    return min(timed) if timed else (None, None)


def error_table(reports):
    """Penumbra beside the best Embree of each error."""
    rows = [("scene", "threads", "RMSE", "Penumbra s", "best Embree s", "", "times faster", "than robust")]
    for report in reports:
        curves = [points(r["budgets"]) for r in penumbras(report)]
        for target in TARGETS:
            seconds, name = best_peer(target, report, "embree")
            robust = min((r for r in report["renderers"] if r["name"].endswith("robust")),
                         key=lambda r: time_at(target, points(r["budgets"])) or math.inf)
            rows.append((report["scene"], report["threads"], f"{target:.0e}",
                         seconds_text(soonest(target, curves)), seconds_text(seconds), name or "-",
                         spread(ratios_at(target, budgets_of(report, name), report)) if name else "-",
                         spread(ratios_at(target, robust["budgets"], report))))
    print_table("Time at equal RMSE, brute force with Embree (median, least–most over the runs)", rows)
    rows = [("scene", "threads", "parse", "build", "Embree's build", "encode", "reference's RMSE")]
    for r in reports:
        rows.append((r["scene"], r["threads"], *(f"{1e3 * v:.1f}" for v in (
            r["parse_s"], r["build_s"]["penumbra"], r["build_s"]["embree"], r["encode_s"])), f"{r['reference_rmse']:.1e}"))
    print_table("Apart from rendering, ms", rows)
    for r in reports:
        if 10 * r["reference_rmse"] > TARGETS[-1]:
            print(f"  {r['scene']}: the reference adds more than 1 % to squared errors of RMSE {TARGETS[-1]:.0e}")


def draw(axes, renderers):
    """Time against error of each, Penumbra in bold."""
    for renderer in renderers:
        curve = points(renderer["budgets"])
        own = renderer["name"].startswith("penumbra")
        axes.loglog([s for _, s in curve], [e for e, _ in curve], "o-" if renderer["name"] != "penumbra target" else "o--",
                    label=renderer["name"], linewidth=2.5 if own else 1, markersize=4 if own else 2)
    axes.grid(True, which="both", alpha=0.3)


def plot(report, extra=()):
    """Time against error of one scene beside other renderers, as a PNG."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, axes = pyplot.subplots(figsize=(7, 5))
    draw(axes, [*report["renderers"], *extra])
    axes.set(xlabel=f"seconds, {report['threads']} threads", ylabel="RMSE", title=report["scene"])
    axes.legend(fontsize=8)
    RESULTS.mkdir(parents=True, exist_ok=True)
    path = RESULTS / f"{report['scene']}-{report['threads']}.png"
    figure.savefig(path, dpi=110)
    pyplot.close(figure)
    return path
