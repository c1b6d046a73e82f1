"""A `penumbra serve` of a test's own, and the requests to it."""
import http.client
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import contextmanager
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(sys.argv[1]).resolve() if len(sys.argv) > 1 else ROOT / "build/release/bin"
PATIENCE_S = 30


def job(**options):
    """A ball under a light; endless with edge=1200 and samples_per_pixel=1024."""
    scene = {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40},
             "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
             "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1, "radius": 0.5}]}
    return {"scene": scene, "options": {"width": 16, "height": 16, **options}}


ENDLESS = job(width=1200, height=1200, samples_per_pixel=1024, shadow_samples=256)


class Answer:
    def __init__(self, response):
        self.status, self.headers, self.body = response.status, response.headers, response.read()

    @property
    def json(self):
        return json.loads(self.body)


class Server:
    def __init__(self, *flags, listen="127.0.0.1:0", environment=None):
        self.folder = tempfile.TemporaryDirectory()
        self.log_path = Path(self.folder.name) / "log"
        command = [BIN / "penumbra", "serve", "--listen", listen, "--store", f"{self.folder.name}/store", *map(str, flags)]
        with self.log_path.open("wb") as log:
            self.process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=log, text=True,
                                            env={**os.environ, **(environment or {})})
        self.address = self.read_address("listening on ")
        self.admin = self.read_address("administration on ") if "--admin-listen" in flags else None

    def read_address(self, prefix):
        line = self.process.stdout.readline()
        if not line.startswith(prefix):
            raise RuntimeError(f"no server: {line}{self.log_path.read_text()}")
        return line.strip().rsplit("http://", 1)[1]

    def call(self, method, path, body=None, headers=None, address=None, timeout=PATIENCE_S):
        connection = http.client.HTTPConnection(address or self.address, timeout=timeout)
        try:
            if isinstance(body, dict):
                body = json.dumps(body)
            fields = {"Content-Type": "application/json"} if body is not None else {}
            connection.request(method, path, body, {**fields, **(headers or {})})
            return Answer(connection.getresponse())
        finally:
            connection.close()

    def get(self, path, **more):
        return self.call("GET", path, **more)

    def post(self, path, body, **more):
        return self.call("POST", path, body, **more)

    def submit(self, body, **more):
        return self.post("/v1/jobs", body, **more).json["id"]

    def open_events(self, job_id, address=None):
        """The response of an event stream, to be read line by line."""
        connection = http.client.HTTPConnection(address or self.address, timeout=PATIENCE_S)
        connection.request("GET", f"/v1/jobs/{job_id}/events")
        return connection.getresponse()

    def log_entries(self):
        return [json.loads(line) for line in self.log_path.read_text().splitlines()]

    def signal(self, number):
        self.process.send_signal(number)

    def stop(self):
        if self.process.poll() is None:
            self.signal(signal.SIGTERM)
        try:
            self.process.wait(PATIENCE_S)
        finally:
            if self.process.poll() is None:
                self.process.kill()
                self.process.wait()
            self.process.stdout.close()
            self.folder.cleanup()
        return self.process.returncode


@contextmanager
def serving(*flags, **more):
    server = Server(*flags, **more)
    try:
        yield server
    finally:
        server.stop()


def eventually(is_so):
    deadline = time.monotonic() + PATIENCE_S
    while not is_so():
        if time.monotonic() > deadline:
            return False
        time.sleep(0.02)
    return True


def penumbra(*words, **more):
    return subprocess.run([BIN / "penumbra", *map(str, words)], capture_output=True, text=True, **more)
