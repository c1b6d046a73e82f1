"""docker/Caddyfile with Debian's Caddy before a real server: TLS, events as they come, clients that leave."""
import http.client
import json
import os
import socket
import ssl
import subprocess
import tempfile
import time
import unittest
from contextlib import contextmanager

from serving import ENDLESS, PATIENCE_S, ROOT, Answer, eventually, job, serving

CADDYFILE = ROOT / "docker/Caddyfile"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class LoopbackConnection(http.client.HTTPSConnection):
    """To 127.0.0.1, whatever name the certificate is for: a bare machine has no /etc/hosts that knows localhost."""

    def __init__(self, name, port, context):
        super().__init__(name, port, timeout=PATIENCE_S, context=context)
        self.tls = context

    def connect(self):
        dialed = socket.create_connection(("127.0.0.1", self.port), self.timeout)
        self.sock = self.tls.wrap_socket(dialed, server_hostname=self.host)


@contextmanager
def proxy(server, **variables):
    """Caddy with its own authority; yields a function that opens a connection to it."""
    with tempfile.TemporaryDirectory() as folder:
        port = free_port()
        environment = {**os.environ, "XDG_DATA_HOME": folder, "XDG_CONFIG_HOME": folder, "HOME": folder,
                       "PENUMBRA_SITE": f"https://localhost:{port}", "PENUMBRA_UPSTREAM": server.address, **variables}
        # Neither the system's store of authorities nor port 80 is a test's to touch.
        text = CADDYFILE.read_text().replace("admin off", "admin off\n\tskip_install_trust\n\tauto_https disable_redirects")
        config = os.path.join(folder, "Caddyfile")
        with open(config, "w") as file:
            file.write(text)
        with open(os.path.join(folder, "log"), "wb") as log:
            process = subprocess.Popen(["caddy", "run", "--config", config, "--adapter", "caddyfile"], env=environment, stdout=log,
                                       stderr=log)
        authority = os.path.join(folder, "caddy/pki/authorities/local/root.crt")

        def connect():
            context = ssl.create_default_context(cafile=authority)
            return LoopbackConnection("localhost", port, context)

        def is_up():
            try:
                connection = connect()
                connection.request("GET", "/healthz")
                return connection.getresponse().status == 200
            except (OSError, ssl.SSLError):
                return False

        try:
            assert eventually(is_up), open(os.path.join(folder, "log")).read()
            yield connect
        finally:
            process.terminate()
            try:
                process.wait(PATIENCE_S)
            finally:
                process.kill()
                process.wait()


def call(connect, method, path, body=None):
    connection = connect()
    try:
        connection.request(method, path, json.dumps(body) if body is not None else None,
                           {"Content-Type": "application/json"} if body is not None else {})
        return Answer(connection.getresponse())
    finally:
        connection.close()


class Caddy(unittest.TestCase):
    def test_the_file_is_valid(self):
        checked = subprocess.run(["caddy", "validate", "--config", CADDYFILE, "--adapter", "caddyfile"], capture_output=True, text=True)
        self.assertEqual(checked.returncode, 0, checked.stderr)

    def test_a_job_through_the_proxy(self):
        with serving() as server, proxy(server) as connect:
            image = call(connect, "POST", "/v1/render", job(shadow_samples=4))
            self.assertEqual((image.status, image.body[:4]), (200, b"\x89PNG"))
            self.assertEqual(call(connect, "GET", "/metrics").status, 404)

            # Events come one by one, while the job still runs.
            endless = call(connect, "POST", "/v1/jobs", {**ENDLESS, "options": {**ENDLESS["options"], "progress_interval_s": 0.1}}).json["id"]
            connection = connect()
            start = time.monotonic()
            connection.request("GET", f"/v1/jobs/{endless}/events")
            stream = connection.getresponse()
            self.assertEqual(stream.headers["Content-Type"], "text/event-stream")
            lines = iter(stream.readline, b"")
            self.assertIn(b"event: progress\n", lines)
            self.assertIn(b"event: progress\n", lines)
            self.assertLess(time.monotonic() - start, 10)
            self.assertEqual(server.get(f"/v1/jobs/{endless}").json["state"], "running")
            canceled = call(connect, "POST", f"/v1/jobs/{endless}/cancel")
            self.assertEqual(canceled.status, 200, canceled.body)
            self.assertIn(b"event: canceled\n", lines)
            connection.close()

    def test_the_proxy_takes_bodies_as_large_as_the_server_does(self):
        large = {**job(), "scene": {**job()["scene"], "name": "x" * 60_000}}
        # Over its limit Debian's Caddy says 502 where the server has not answered yet, else 413.
        for limit, statuses in (("100KiB", [200]), ("50KiB", [413, 502])):
            with serving("--max-body", "100KiB") as server, proxy(server, PENUMBRA_MAX_BODY=limit) as connect:
                self.assertIn(call(connect, "POST", "/v1/render", large).status, statuses, limit)

    def test_a_client_that_leaves_cancels_its_render(self):
        with serving() as server, proxy(server) as connect:
            connection = connect()
            connection.request("POST", "/v1/render", json.dumps(ENDLESS), {"Content-Type": "application/json"})
            states = lambda: [each["state"] for each in server.get("/v1/jobs").json["jobs"]]
            self.assertTrue(eventually(lambda: states() == ["running"]))
            connection.sock.close()
            self.assertTrue(eventually(lambda: states() == ["canceled"]))
