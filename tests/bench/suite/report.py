"""All tables and plots from the figures measured last, and the part of README.md that holds them."""
import contextlib
import io
import re
import subprocess

from suite import errors, growth, points, rays
from suite.common import RESULTS, ROOT
from suite.peers import compare

README = ROOT / "tests/bench/README.md"
BEGIN, END = "<!-- tables: begin -->", "<!-- tables: end -->"


def first_line(*command, pattern=r".+"):
    try:
        output = subprocess.run(command, capture_output=True, text=True)
    except FileNotFoundError:
        return f"no {command[0]}"
    found = re.search(pattern, output.stdout + output.stderr)
    return found.group(0).strip() if found else "unknown"


def machine():
    """What the figures were measured on and with."""
    processor = first_line("lscpu", pattern=r"(?<=Model name:).+")
    instructions = "AVX-512" if "avx512f" in first_line("lscpu", pattern=r"Flags:.+") else "no AVX-512"
    return "\n".join([
        f"{processor}, {first_line('nproc')} cores, {instructions}; {first_line('uname', '-sm')}",
        first_line("g++", "--version"),
        "Penumbra " + first_line("git", "-C", str(ROOT), "log", "-1", "--format=%h of %cs"),
        "Embree " + first_line("dpkg-query", "-W", "-f", "${Version}", "libembree-dev"),
        first_line("povray", "--version", pattern=r"POV-Ray [\d.]+"),
        first_line("blender", "--version", pattern=r"Blender [\d.]+") + " (Cycles)",
    ])


def tables():
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        print(machine())
        for module in (rays, errors, compare, growth, points):
            module.show()
    return text.getvalue()


def report(is_written=False):
    text = tables()
    print(text)
    print(f"plots and JSON: {RESULTS}")
    if is_written:
        before, rest = README.read_text().split(BEGIN)
        README.write_text(f"{before}{BEGIN}\n```\n{text.strip()}\n```\n{END}{rest.split(END)[1]}")
