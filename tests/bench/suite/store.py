"""The durable store under load, each figure beside its gate."""
import http.client
import json
import re
import shutil
import signal
import subprocess
import tempfile
import time
from pathlib import Path

from suite.common import BIN, ROOT, print_table

STORED, SECONDS, CONNECTIONS = 10_000, 10, 8
SCENE = {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40},
         "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
         "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1}]}
# Every body has a seed of its own: an equal one would be found again, or join another.
LOAD = """
local body = [[{"scene": %s, "options": {"width": 8, "height": 8, "seed": ]]
local threads, next_seed = 0, 0
function setup(thread) thread:set("first", %d + 1000000 * threads); threads = threads + 1 end
function init() next_seed = first end
function request()
  next_seed = next_seed + 1
  return wrk.format("POST", "/v1/jobs", {["Content-Type"] = "application/json"}, body .. next_seed .. "}}")
end
"""


class Server:
    def __init__(self, store):
        start = time.perf_counter()
        self.process = subprocess.Popen([BIN / "penumbra", "serve", "--listen", "127.0.0.1:0", "--store", store, "--jobs", "2",
                                         "--queue", "1000000", "--keep-jobs", "1000000", "--log-level", "warning"],
                                        stdout=subprocess.PIPE, text=True)
        self.address = self.process.stdout.readline().rsplit("http://", 1)[1].strip()
        assert self.call("GET", "/readyz")[0] == 200
        self.ready_s = time.perf_counter() - start

    def call(self, method, path, body=None):
        connection = http.client.HTTPConnection(self.address)
        connection.request(method, path, body, {"Content-Type": "application/json"} if body else {"Content-Length": "0"})
        response = connection.getresponse()
        content = response.read()
        connection.close()
        return response.status, json.loads(content) if content.startswith(b"{") else content

    def submit_endless(self, seed):
        options = {"width": 4000, "height": 4000, "samples_per_pixel": 64, "seed": seed, "priority": 100}
        return self.call("POST", "/v1/jobs", json.dumps({"scene": SCENE, "options": options}))[1]["id"]

    def unfinished(self):
        jobs = [self.call("GET", f"/v1/jobs?limit=1&state={state}")[1]["jobs"] for state in ("queued", "running")]
        return bool(jobs[0] or jobs[1])

    def end(self, how):
        start = time.perf_counter()
        self.process.send_signal(how)
        self.process.wait()
        return time.perf_counter() - start


def seconds_of(text):
    number, unit = re.fullmatch(r"([\d.]+)(us|ms|s)", text).groups()
    return float(number) * {"us": 1e-6, "ms": 1e-3, "s": 1}[unit]


def submit_for(server, seconds, first_seed, folder):
    """Submits on kept connections: how many a second, p99 in seconds, how many in all."""
    script = Path(folder) / "load.lua"
    script.write_text(LOAD % (json.dumps(SCENE), first_seed))
    output = subprocess.run(["wrk", "-t2", f"-c{CONNECTIONS}", f"-d{seconds}s", "--latency", "-s", script, f"http://{server.address}"],
                            check=True, capture_output=True, text=True).stdout
    assert "Non-2xx" not in output and "Socket errors" not in output, output
    total = int(re.search(r"(\d+) requests in", output).group(1))
    return float(re.search(r"Requests/sec:\s+([\d.]+)", output).group(1)), seconds_of(re.search(r"99%\s+(\S+)", output).group(1)), total


def store():
    if not shutil.which("wrk"):
        subprocess.run([ROOT / "docker/install-packages", "bench"], check=True)
    rows = [("", "measured", "gate", "")]

    def judge(name, value, gate, is_met, form):
        rows.append((name, form.format(value), gate, "" if is_met else "MISSED"))

    with tempfile.TemporaryDirectory() as folder:
        server = Server(f"{folder}/store")
        # Every core renders, and what is submitted waits.
        endless = [server.submit_endless(seed) for seed in (1, 2)]
        rate, p99, total = submit_for(server, SECONDS, 0, folder)
        judge("durable submits a second, every core rendering", rate, ">= 500", rate >= 500, "{:.0f}")
        judge("their p99, ms", 1000 * p99, "<= 50", p99 <= 0.05, "{:.1f}")
        while total < STORED:
            total += submit_for(server, 5, 100_000_000 + total, folder)[2]

        server.end(signal.SIGKILL)
        server = Server(f"{folder}/store")
        judge(f"kill -9 to ready, s, {total} jobs waiting", server.ready_s, "<= 2", server.ready_s <= 2, "{:.2f}")
        gone_s = server.end(signal.SIGTERM)
        judge("SIGTERM to gone, s, every core rendering", gone_s, "<= 10", gone_s <= 10, "{:.2f}")

        server = Server(f"{folder}/store")
        for job in endless:
            server.call("POST", f"/v1/jobs/{job}/cancel")
        while server.unfinished():
            time.sleep(0.5)
        server.end(signal.SIGKILL)
        server = Server(f"{folder}/store")
        judge(f"kill -9 to ready, s, {total} jobs with images", server.ready_s, "<= 2", server.ready_s <= 2, "{:.2f}")
        succeeded, token = 0, ""
        while token is not None:
            page = server.call("GET", f"/v1/jobs?limit=1000&state=succeeded{token and '&page_token=' + token}")[1]
            succeeded, token = succeeded + len(page["jobs"]), page["next_page_token"]
        # There may be more than were counted: stored, but the kill cut off their answers.
        judge("of which lost", max(0, total - succeeded), "0", succeeded >= total, "{}")
        server.end(signal.SIGTERM)
    print_table(f"The store: {CONNECTIONS} kept connections, {SECONDS} s", rows)
