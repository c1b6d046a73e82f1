"""The second address: answers whatever the first is busy with."""
import socket
import time
import unittest

from serving import ENDLESS, eventually, serving


class Admin(unittest.TestCase):
    def test_answers_while_cores_connections_and_streams_are_taken(self):
        flags = ["--admin-listen", "127.0.0.1:0", "--max-connections", 24, "--max-streams", 4, "--max-client-streams", 4,
                 "--jobs", 2, "--queue", 2]
        with serving(*flags) as server:
            jobs = [server.submit(ENDLESS) for _ in range(4)]
            self.assertEqual(server.post("/v1/jobs", ENDLESS).status, 429)
            self.assertTrue(eventually(lambda: server.get(f"/v1/jobs/{jobs[1]}").json["state"] == "running"))
            streams = [server.open_events(jobs[0]) for _ in range(4)]
            self.assertEqual({stream.status for stream in streams}, {200})
            told = server.get(f"/v1/jobs/{jobs[0]}/events")
            self.assertEqual((told.status, told.body), (200, b"retry: 2000\n\n"))
            host, port = server.address.split(":")
            held = [socket.create_connection((host, int(port))) for _ in range(20)]
            self.assertTrue(eventually(lambda: server.get("/healthz").status == 503))
            slowest = 0
            for path in ["/healthz", "/readyz", "/metrics"] * 20:
                start = time.monotonic()
                answer = server.get(path, address=server.admin)
                slowest = max(slowest, time.monotonic() - start)
                self.assertEqual(answer.status, 200)
            self.assertLess(slowest, 1)
            self.assertIn(b"penumbra_http_event_streams 4\n", answer.body)
            for connection in held:
                connection.close()

    def test_knows_nothing_else_and_asks_for_no_key(self):
        with serving("--admin-listen", "127.0.0.1:0") as server:
            for path in ("/", "/v1/jobs", "/v1/openapi.json"):
                self.assertEqual(server.get(path, address=server.admin).status, 404)
            self.assertEqual(server.post("/v1/render", ENDLESS, address=server.admin).status, 404)

    def test_tells_of_the_stop_until_it_is_done(self):
        with serving("--admin-listen", "127.0.0.1:0") as server:
            self.assertEqual(server.get("/readyz", address=server.admin).status, 200)
            self.assertEqual(server.stop(), 0)
