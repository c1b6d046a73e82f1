"""What the server must manage, each figure beside its gate; and a soak, which must not grow."""
import http.client
import json
import re
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from suite.common import BIN, ROOT, print_table

WARM_S, MEASURED_S = 1, 6


def body(edge=16, **options):
    scene = {"camera": {"position": [0, 0, 5], "direction": [0, 0, -1], "vertical_fov": 40},
             "objects": [{"type": "sphere", "center": [0, 0, 0], "radius": 1}],
             "lights": [{"type": "point", "position": [3, 4, 5], "intensity": 1, "radius": 0.5}]}
    return {"scene": scene, "options": {"width": edge, "height": edge, **options}}


def endless(**options):
    return body(1200, samples_per_pixel=1024, shadow_samples=256, **options)


class Server:
    def __init__(self, *flags):
        self.folder = tempfile.TemporaryDirectory()
        with open(Path(self.folder.name) / "log", "wb") as log:
            self.process = subprocess.Popen(
                [BIN / "penumbra", "serve", "--listen", "127.0.0.1:0", "--store", f"{self.folder.name}/store", *map(str, flags)],
                stdout=subprocess.PIPE, stderr=log, text=True)
        self.address = self.process.stdout.readline().rsplit("http://", 1)[1].strip()
        self.local = threading.local()

    def call(self, method, path, value=None):
        """On a connection kept by each thread."""
        for _ in range(2):
            connection = getattr(self.local, "connection", None) or http.client.HTTPConnection(self.address, timeout=60)
            self.local.connection = connection
            try:
                connection.request(method, path, json.dumps(value) if value is not None else None, {"Content-Type": "application/json"})
                response = connection.getresponse()
                return response.status, response.read()
            except (http.client.HTTPException, OSError):
                connection.close()
                self.local.connection = None
        raise RuntimeError("no answer")

    def submit(self, value):
        status, answer = self.call("POST", "/v1/jobs", value)
        assert status == 202, answer
        return json.loads(answer)["id"]

    def state(self, job_id):
        return json.loads(self.call("GET", f"/v1/jobs/{job_id}")[1])["state"]

    def wait(self, job_id, *states):
        while self.state(job_id) not in states:
            time.sleep(0.002)

    def metric(self, name):
        text = self.call("GET", "/metrics")[1].decode()
        return float(re.search(rf"^{re.escape(name)} (\S+)$", text, re.MULTILINE)[1])

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(30)
        self.process.stdout.close()
        self.folder.cleanup()


def quantile(values, share):
    values = sorted(values)
    return values[min(len(values) - 1, int(share * len(values)))]


def milliseconds(text):
    number, unit = re.fullmatch(r"([\d.]+)(us|ms|s|m)", text).groups()
    return float(number) * {"us": 1e-3, "ms": 1, "s": 1e3, "m": 6e4}[unit]


def wrk(server, path, connections=16):
    """Calls a second; p99 and maximum in milliseconds."""
    command = ["wrk", "-t1", f"-c{connections}", f"-d{MEASURED_S}s", "--latency", f"http://{server.address}{path}"]
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert "Non-2xx" not in text, text
    maximum = re.search(r"Latency +\S+ +\S+ +(\S+)", text)[1]
    return float(re.search(r"Requests/sec: +([\d.]+)", text)[1]), milliseconds(re.search(r"99% +(\S+)", text)[1]), milliseconds(maximum)


def status_calls(rows):
    with Server() as server:
        done = server.submit(body())
        server.wait(done, "succeeded")
        path = f"/v1/jobs/{done}"
        rows.append(("status calls/s, idle", *wrk(server, path)[:1], 20_000, True))
        for seed in range(4):
            server.submit(endless(seed=seed))
        time.sleep(WARM_S)
        calls, p99, maximum = wrk(server, path)
        rows += [("status calls/s, every core rendering", calls, 2_000, True), ("  p99, ms", p99, 10, False),
                 ("  maximum, ms", maximum, 50, False)]


def streams(rows, count=512):
    """How late the last event of a job reaches each of its watchers, after its end is known."""
    with Server("--max-client-streams", count) as server:
        job = server.submit(endless(progress_interval_s=0.25))
        host, port = server.address.split(":")
        selector = selectors.DefaultSelector()
        for _ in range(count):
            client = socket.create_connection((host, int(port)))
            client.sendall(f"GET /v1/jobs/{job}/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
            selector.register(client, selectors.EVENT_READ, [b""])
        opened = set()
        ended = {}
        canceled = None
        deadline = time.monotonic() + 60
        while len(ended) < count and time.monotonic() < deadline:
            for key, _ in selector.select(0.1):
                data = key.fileobj.recv(65536)
                key.data[0] = key.data[0][-64:] + data
                if b"event: progress" in key.data[0]:
                    opened.add(key.fd)
                if b"event: canceled" in key.data[0] or not data:
                    ended[key.fd] = time.monotonic()
                    selector.unregister(key.fileobj)
                    key.fileobj.close()
            if canceled is None and len(opened) == count:
                held = server.metric("penumbra_http_event_streams")
                server.call("POST", f"/v1/jobs/{job}/cancel")
                server.wait(job, "canceled")
                canceled = time.monotonic()
        rows.append(("event streams held", held if canceled else len(opened), count, True))
        lags = [1000 * max(0, at - canceled) for at in ended.values()] if canceled and len(ended) == count else [float("inf")]
        rows.append(("  lag p99, ms", quantile(lags, 0.99), 500, False))


def cancels(rows, runs=60):
    with Server("--jobs", 1) as server:
        times = []
        for seed in range(runs):
            job = server.submit(endless(seed=seed))
            server.wait(job, "running")
            time.sleep(0.05)
            start = time.monotonic()
            server.call("POST", f"/v1/jobs/{job}/cancel")
            while server.metric("penumbra_renders") > 0:
                time.sleep(0.001)
            times.append(1000 * (time.monotonic() - start))
        rows.append((f"cancel to free cores, p99 of {runs}, ms", quantile(times, 0.99), 250, False))


def overload(rows):
    """Five times as many clients as there are places, each sending the next job as soon as it has an answer."""
    places, clients = 18, 90
    with Server("--jobs", 2, "--queue", 16, "--key-requests", 0) as server:
        alone = []
        for seed in range(10):
            start = time.monotonic()
            assert server.call("POST", "/v1/render", body(200, seed=seed))[0] == 200
            alone.append(time.monotonic() - start)
        statuses, accepted, lock, stop = {}, [], threading.Lock(), time.monotonic() + MEASURED_S

        def client(number):
            turn = 0
            while time.monotonic() < stop:
                status, answer = server.call("POST", "/v1/jobs", body(200, samples_per_pixel=4, seed=1000 * number + turn + 100))
                turn += 1
                with lock:
                    statuses[status] = statuses.get(status, 0) + 1
                    if status == 202:
                        accepted.append(json.loads(answer)["id"])
                if status == 429:
                    time.sleep(0.02)

        threads = [threading.Thread(target=client, args=(number,)) for number in range(clients)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for job in accepted:
            server.wait(job, "succeeded", "failed", "canceled")
        harmed = sum(server.state(job) != "succeeded" for job in accepted)
        others = sum(count for status, count in statuses.items() if status not in (202, 429))
        rows.append((f"five times overload ({places} places, {clients} clients): refused with 429", statuses.get(429, 0), 1, True))
        rows.append(("  answers that are neither 202 nor 429", others, 0, False))
        rows.append((f"  admitted jobs ({len(accepted)}) that did not succeed", harmed, 0, False))


def terms(rows):
    with Server() as server:
        jobs = [server.submit(endless(seed=seed)) for seed in range(4)]
        clients = []
        host, port = server.address.split(":")
        for _ in range(8):
            client = socket.create_connection((host, int(port)))
            client.sendall(f"GET /v1/jobs/{jobs[0]}/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
            clients.append(client)
        server.wait(jobs[0], "running")
        start = time.monotonic()
        server.process.send_signal(signal.SIGTERM)
        server.process.wait(60)
        rows.append(("SIGTERM to gone, s", time.monotonic() - start, 10, False))


def gates():
    """Prints the table; fails when a gate is missed."""
    subprocess.run([ROOT / "docker/install-packages", "bench"], check=True)
    rows = []
    for part in (status_calls, streams, cancels, overload, terms):
        part(rows)
    missed = [row for row in rows if (row[1] < row[2] if row[3] else row[1] > row[2])]
    print_table("The server beside its gates", [("", "measured", "gate", "")] + [
        (name, f"{value:,.2f}".removesuffix(".00"), ("≥ " if is_least else "≤ ") + f"{gate:,}", "MISSED" if (name, value, gate, is_least) in missed else "ok")
        for name, value, gate, is_least in rows])
    from suite import store
    store.store()
    if missed:
        sys.exit(1)


def soak(seconds=600):
    """Renders, refusals, streams, cancels and lists without end: memory and descriptors must stay where they settle."""
    with Server("--jobs", 2, "--keep-jobs", 200, "--keep-images", "8M", "--queue", 8, "--log-level", "warning") as server:
        stop = time.monotonic() + seconds

        def client(number):
            turn = 0
            while time.monotonic() < stop:
                turn += 1
                seed = 1_000_000 * number + turn
                server.call("POST", "/v1/render", body(64, seed=seed))
                server.call("POST", "/v1/jobs", {"scene": {}})
                status, answer = server.call("POST", "/v1/jobs", endless(seed=seed))
                if status == 202:
                    job = json.loads(answer)["id"]
                    with socket.create_connection(server.address.split(":")) as stream:
                        stream.sendall(f"GET /v1/jobs/{job}/events HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n".encode())
                        stream.recv(4096)
                        server.call("GET", f"/v1/jobs/{job}/preview")
                        server.call("DELETE", f"/v1/jobs/{job}")
                server.call("GET", "/v1/jobs?limit=20")

        threads = [threading.Thread(target=client, args=(number,), daemon=True) for number in range(4)]
        for thread in threads:
            thread.start()
        rows, samples, start = [("seconds", "MiB", "descriptors", "jobs ended")], [], time.monotonic()
        while time.monotonic() < stop:
            time.sleep(max(0.5, seconds / 40))
            memory, descriptors = server.metric("process_resident_memory_bytes"), server.metric("process_open_fds")
            samples.append((memory, descriptors))
            if len(samples) % 4 == 0:
                ended = sum(server.metric(f'penumbra_jobs_ended_total{{state="{s}"}}') for s in ("succeeded", "failed", "canceled"))
                rows.append((f"{time.monotonic() - start:.0f}", f"{memory / 2**20:.1f}", f"{descriptors:.0f}", f"{ended:.0f}"))
        for thread in threads:
            thread.join()
        print_table(f"Soak, {seconds:.0f} s", rows)
        # The first quarter fills caches and the store; then the last quarter is held against the second.
        quarter = len(samples) // 4
        before, after = samples[quarter:2 * quarter], samples[-quarter:]
        most = [max(sample[i] for sample in before) for i in (0, 1)], [max(sample[i] for sample in after) for i in (0, 1)]
        grew = most[1][0] > 1.1 * most[0][0] + (8 << 20) or most[1][1] > most[0][1] + 16
        print("grew" if grew else "did not grow")
        if grew:
            sys.exit(1)
