"""What time against error comes to on one page: ratios beside their bars, what bounds each scene, and a plot of each."""
import html
import io
import statistics

from suite import figures
from suite.common import RESULTS, print_table
from suite.figures import TARGETS

# How many times faster than the best of Embree: every scene, and the median of them, for each of TARGETS.
BARS, MEDIAN_BARS = [1.5, 2, 4, 10], [2, 4, 8, 20]
ENOUGH = 1.5  # times the picture without lights: so a scene is bounded by its camera rays and surfaces


def short(value):
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def firsts(reports):
    """Of each scene the report on the fewest threads."""
    return list({r["scene"]: r for r in sorted(reports, key=lambda r: (r["scene"], -r["threads"]))}.values())


def dark_seconds(report):
    """Penumbra's time for the picture without lights."""
    return statistics.median(report["without_lights_s"])


def own_seconds(report, target):
    return figures.soonest(target, [figures.points(r["budgets"]) for r in figures.penumbras(report)])


def peer_bound(report):
    """Seconds after which no peer had reached the finest of its budgets' errors: of each family the quickest at its finest."""
    bounds = {}
    for renderer in report["renderers"]:
        if renderer["name"].startswith("embree") and renderer["budgets"]:
            last = renderer["budgets"][-1]
            key = renderer["name"].endswith("robust")
            bounds.setdefault(key, []).append((-last["samples"], statistics.median(last["seconds"])))
    return min(min(of_family)[1] for of_family in bounds.values())


def ratio(report, target):
    """(times faster than the best peer, "" or ">" where no peer gets there), or None where Penumbra does not."""
    own = own_seconds(report, target)
    if own is None:
        return None
    _, name = figures.best_peer(target, report, "embree")
    if name is None:
        return peer_bound(report) / own, ">"
    return statistics.median(figures.ratios_at(target, figures.budgets_of(report, name), report)), ""


def cell(report, target, bar):
    """The ratio and whether it is enough: `+` over the bar, `=` bounded by rays and surfaces, `-` neither."""
    found = ratio(report, target)
    if found is None:
        return "none -"
    value, sign = found
    mark = "+" if value >= bar else "=" if own_seconds(report, target) <= ENOUGH * dark_seconds(report) else "-"
    return f"{sign}{short(value)} {mark}"


def bound(report, target):
    """Of the time to this error, the share of camera rays and surfaces; what the rest comes to."""
    own = own_seconds(report, target)
    if own is None:
        return "not reached"
    share = min(1, dark_seconds(report) / own)
    budgets = figures.budgets_of(report, "penumbra")
    budget = next((b for b in budgets if statistics.median(b["rmse"]) <= target), budgets[-1])
    rays = budget["shadow_rays"] / report["edge"] ** 2
    if ENOUGH * share >= 1:
        return f"camera rays and surfaces, {100 * share:.0f} %"
    rest_us = 1e6 * (own - dark_seconds(report)) * report["threads"] / report["edge"] ** 2
    return f"{100 * share:.0f} % without lights; the rest {short(rest_us)} us a pixel, {short(rays)} shadow rays"


def rows_of(reports, threads):
    """The table of one number of threads; the last row is the medians'."""
    chosen = [r for r in reports if r["threads"] == threads]
    rows = [(r["scene"], r["edge"], f"{1e3 * dark_seconds(r):.0f}", *(figures.seconds_text(own_seconds(r, t)) for t in TARGETS),
             *(cell(r, t, bar) for t, bar in zip(TARGETS, BARS))) for r in chosen]
    medians = []
    for target, bar in zip(TARGETS, MEDIAN_BARS):
        values = [found[0] if (found := ratio(r, target)) else 0 for r in chosen]
        medians.append(f"{statistics.median(values):.2g} {'+' if statistics.median(values) >= bar else '-'}")
    return [*rows, ("median", "", "", *[""] * len(TARGETS), *medians)]


def headings():
    errors = [f"{t:.0e}" for t in TARGETS]
    return ("scene", "pixels", "dark ms", *(f"s, {e}" for e in errors), *(f"x, {e}" for e in errors))


def explanation(threads):
    bars = lambda values: " / ".join(f"{v:g}" for v in values)
    return (f"Times faster than the best of Embree, {threads} thread{'s' if threads > 1 else ''} (bars: {bars(BARS)}, medians {bars(MEDIAN_BARS)}; "
            f"+ over, - under, = bounded by rays and surfaces: at most {ENOUGH} x the time without lights, 'dark')")


def print_ratios(reports):
    for threads in sorted({r["threads"] for r in reports}):
        print_table(explanation(threads), [headings(), *rows_of(reports, threads)])
    print_table("What bounds each, at 1e-2 and at 1e-3", [("scene", "1e-2", "1e-3"), *(
        (r["scene"], bound(r, 1e-2), bound(r, 1e-3)) for r in firsts(reports))])


def plots(reports):
    """Time against error of every scene, as SVG: Penumbra over its samples and its targets, and every Embree."""
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    columns = 4
    lines = -(-len(reports) // columns)
    figure, grid = pyplot.subplots(lines, columns, figsize=(3.4 * columns, 2.9 * lines), squeeze=False)
    for axes in grid.flat[len(reports):]:
        axes.set_axis_off()
    for axes, report in zip(grid.flat, reports):
        figures.draw(axes, report["renderers"])
        axes.axvline(dark_seconds(report), color="grey", linestyle=":", label="without lights")
        axes.set_title(f"{report['scene']}, {report['threads']} thread{'s' if report['threads'] > 1 else ''}", fontsize=9)
        axes.tick_params(labelsize=7)
    figure.legend(*grid[0, 0].get_legend_handles_labels(), loc="upper center", ncol=9, fontsize=8)
    figure.supxlabel("seconds", fontsize=9)
    figure.supylabel("RMSE", fontsize=9)
    figure.tight_layout(rect=(0, 0, 1, 1 - 0.3 / (2.9 * lines)))
    text = io.StringIO()
    figure.savefig(text, format="svg")
    pyplot.close(figure)
    return text.getvalue()[text.getvalue().index("<svg"):]


def html_table(rows):
    line = lambda row, tag: "<tr>" + "".join(f"<{tag}>{html.escape(str(c))}</{tag}>" for c in row) + "</tr>"
    return "<table>" + line(rows[0], "th") + "".join(line(row, "td") for row in rows[1:]) + "</table>"


def write(reports):
    """The page, in one file."""
    parts = []
    for threads in sorted({r["threads"] for r in reports}):
        parts.append(f"<h2>{html.escape(explanation(threads))}</h2>" + html_table([headings(), *rows_of(reports, threads)]))
    shown = firsts(reports)
    parts.append("<h2>What bounds each</h2>" + html_table([("scene", *(f"{t:.0e}" for t in TARGETS)), *(
        (r["scene"], *(bound(r, t) for t in TARGETS)) for r in shown)]))
    style = ("body{font:13px sans-serif;margin:1.5em}h2{font-size:14px}table{border-collapse:collapse}"
             "td,th{padding:2px 8px;text-align:right;border-bottom:1px solid #ddd}td:first-child{text-align:left}svg{max-width:100%;height:auto}")
    path = RESULTS / "errors.html"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(f"<!doctype html><meta charset=utf-8><title>Time against error</title><style>{style}</style>"
                    f"<h1>Time against error</h1>{''.join(parts)}{plots(shown)}\n")
    return path
