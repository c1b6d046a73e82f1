"""10^4 to 10^7 triangles of one surface: build and render times, and memory."""
import json
import subprocess

from suite.common import BIN, build, load, print_table, save

LIMIT = 4 << 30  # bytes


def growth(powers=(4, 5, 6, 7), runs=5, edge=800, thread_counts=(1, 2)):
    build("bench_growth")
    lines = []
    for threads in thread_counts:
        for power in powers:
            output = subprocess.run([BIN / "bench_growth", str(10 ** power), "--threads", str(threads), "--runs", str(runs),
                                     "--edge", str(edge)], check=True, capture_output=True, text=True).stdout
            lines.append(json.loads(output))
            save("growth", lines)
    show(lines)


def show(lines=None):
    lines = lines or load("growth") or []
    if not lines:
        return
    rows = [("triangles", "threads", "build s", "render s", "x the least", "peak MiB", "within 4 GiB")]
    for line in lines:
        least = min(l["render_s"] for l in lines if l["threads"] == line["threads"] and l["triangles"] < 20000)
        rows.append((line["triangles"], line["threads"], f"{line['build_s']:.3f}", f"{line['render_s']:.3f}",
                     f"{line['render_s'] / least:.2f}", line["peak_bytes"] >> 20, "yes" if line["peak_bytes"] < LIMIT else "NO"))
    print_table("The same surface in more triangles, 64 shadow samples", rows)
