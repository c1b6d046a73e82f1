"""What every part of the benchmark needs: folders, the programs, tables."""
import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[3]
BIN = Path(os.environ.get("PENUMBRA_BIN", ROOT / "build/release/bin"))
RESULTS = ROOT / os.environ.get("PENUMBRA_BENCH_RESULTS", "build/bench")  # scenes, references, tables, plots


def print_table(title, rows):
    print(f"\n{title}")
    widths = [max(len(str(row[i])) for row in rows) for i in range(len(rows[0]))]
    for row in rows:
        print("  " + "  ".join(str(cell).rjust(width) if i else str(cell).ljust(width)
                               for i, (cell, width) in enumerate(zip(row, widths))))


def build(*programs):
    """Installs what is missing and builds the named programs; with PENUMBRA_BIN, takes them from there."""
    if "PENUMBRA_BIN" in os.environ:
        return
    subprocess.run([ROOT / "docker/install-packages", "build", "run", "test", "bench"], check=True)
    for command in (["cmake", "--preset", "release", "-DPENUMBRA_TESTS=ON", "-DPENUMBRA_BENCH=ON"],
                    ["cmake", "--build", "--preset", "release", "--target", *programs, "--", "--quiet"]):
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
        if done.returncode:
            sys.exit(done.stdout + done.stderr)


def run_program(program, *arguments):
    subprocess.run([str(BIN / program), *map(str, arguments)], check=True)


def version():
    """The commit, and whether something differs from it."""
    return subprocess.run(["git", "-C", ROOT, "describe", "--always", "--dirty"], capture_output=True, text=True).stdout.strip()


def save(name, figures):
    """Keeps a part's figures as JSON for `report`."""
    RESULTS.mkdir(parents=True, exist_ok=True)
    (RESULTS / f"{name}.json").write_text(json.dumps(figures, indent=1))


def save_report(name, report):
    """Keeps what was measured of one scene on so many threads in the place of what was there of it."""
    place = lambda r: (r["scene"], r["threads"])
    save(name, sorted([r for r in load(name) or [] if place(r) != place(report)] + [report], key=place))


def load(name):
    path = RESULTS / f"{name}.json"
    return json.loads(path.read_text()) if path.is_file() else None
