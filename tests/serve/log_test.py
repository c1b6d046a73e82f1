"""The log: a line of JSON for every request, whatever clients send."""
import socket
import unittest

from serving import eventually, job, serving

TRACE, PARENT = "4bf92f3577b34da6a3ce929d0e0e4736", "00f067aa0ba902b7"


def send(server, data):
    """Raw bytes, and all that comes back."""
    host, port = server.address.split(":")
    with socket.create_connection((host, int(port)), timeout=30) as connection:
        connection.sendall(data)
        connection.shutdown(socket.SHUT_WR)
        answer = b""
        while received := connection.recv(65536):
            answer += received
    return answer


class Log(unittest.TestCase):
    def requests(self, server, count):
        found = []

        def is_complete():
            found[:] = [entry for entry in server.log_entries() if entry.get("event") == "request"]
            return len(found) >= count

        self.assertTrue(eventually(is_complete))
        self.assertEqual(len(found), count)
        return found

    def test_every_request_has_one_line(self):
        with serving() as server:
            server.get("/healthz", headers={"X-Request-Id": "my-id", "traceparent": f"00-{TRACE}-{PARENT}-01"})
            image = server.post("/v1/render", job())
            server.get("/v1/jobs/x/events?access_token=secret", headers={"X-Request-Id": "a"})
            server.get("/healthz", headers={"X-Request-Id": "b", "traceparent": f"00-{TRACE}-{'0' * 16}-01"})
            # A line is written after its answer: those of two connections may change places.
            entries = {entry["request_id"]: entry for entry in self.requests(server, 4)}
        health, render, missing, untraced = (entries[name] for name in ("my-id", image.headers["X-Request-Id"], "a", "b"))
        self.assertEqual((health["request_id"], health["trace_id"], health["parent_id"]), ("my-id", TRACE, PARENT))
        self.assertEqual((health["method"], health["target"], health["route"], health["status"]), ("GET", "/healthz", "/healthz", 200))
        self.assertEqual(health["client"], "127.0.0.1")
        self.assertEqual(health["level"], "info")
        self.assertRegex(health["time"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3}Z$")
        self.assertGreater(render["bytes"], len(image.body))
        self.assertGreater(render["duration_ms"], 0)
        self.assertEqual((missing["target"], missing["route"], missing["status"]), ("/v1/jobs/x/events?access_token=***", "/v1/jobs/{id}/events", 404))
        self.assertNotIn("trace_id", untraced)

    def test_hostile_requests_stay_on_their_line(self):
        with serving() as server:
            for data in (b"GET /\x1b[31m HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"GET /%0a%22%1b%00 HTTP/1.1\r\nHost: a\r\n\r\n",
                         b"GET /\xff\"\\ HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n", b"nonsense\r\n\r\n",
                         b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Request-Id: x\r\nX-Request-Id: y\r\n\r\n"):
                answer = send(server, data)
                head = answer.split(b"\r\n\r\n")[0].split(b"\r\n")
                self.assertTrue(all(32 <= byte < 127 for line in head for byte in line), head)
            entries = self.requests(server, 5)
            self.assertTrue(all(32 <= byte < 127 or byte in (10, 0xEF, 0xBF, 0xBD) for byte in server.log_path.read_bytes()))
        self.assertIn("/%0a%22%1b%00", [entry.get("target") for entry in entries])

    def test_text_for_people(self):
        with serving("--log-format", "text") as server:
            server.get("/healthz", headers={"X-Request-Id": "my-id"})
            line = []
            self.assertTrue(eventually(lambda: line.extend(
                each for each in server.log_path.read_text().splitlines() if "GET /healthz" in each) or line))
        self.assertRegex(line[0], r'^\S+Z info 127\.0\.0\.1 - "GET /healthz" 200 \d+ \d+\.\d{3} ms my-id$')

    def test_warnings_only_is_no_requests(self):
        with serving("--log-level", "warning") as server:
            server.get("/healthz")
            server.stop()
            self.assertEqual(server.process.returncode, 0)
