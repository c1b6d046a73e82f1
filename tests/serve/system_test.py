"""What the system sees of a server: scheduling, the backlog, signals."""
import os
import signal
import socket
import time
import unittest
from pathlib import Path

from serving import ENDLESS, eventually, job, serving

SCHED_IDLE = 5


class System(unittest.TestCase):
    def policies(self, server):
        threads = Path(f"/proc/{server.process.pid}/task")
        return [os.sched_getscheduler(int(thread.name)) for thread in threads.iterdir()]

    def test_render_threads_give_way_unless_told_otherwise(self):
        with serving() as server:
            self.assertEqual(self.policies(server).count(SCHED_IDLE), len(os.sched_getaffinity(0)))
        with serving("--normal-priority") as server:
            self.assertEqual(self.policies(server).count(SCHED_IDLE), 0)

    def test_a_burst_of_clients_is_let_in_at_once(self):
        """With the library's backlog of 5 all but a few would wait a second for their next try."""
        with serving() as server:
            host, port = server.address.split(":")
            server.signal(signal.SIGSTOP)
            clients = []
            try:
                for _ in range(200):
                    clients.append(socket.create_connection((host, int(port)), timeout=0.5))
            finally:
                server.signal(signal.SIGCONT)
            self.assertEqual(len(clients), 200)
            for client in clients:
                client.close()

    def test_a_silent_stream_says_that_it_lives(self):
        with serving("--jobs", 1) as server:
            server.submit(ENDLESS)
            waiting = server.submit(job())
            stream = server.open_events(waiting)
            start = time.monotonic()
            lines = iter(stream.readline, b"")
            self.assertIn(b": the stream is alive\n", lines)
            self.assertLess(time.monotonic() - start, 20)

    def test_sigterm_ends_it_in_time(self):
        with serving() as server:
            jobs = [server.submit(ENDLESS) for _ in range(3)]
            streams = [server.open_events(jobs[0]) for _ in range(5)]
            for stream in streams:
                self.assertIn(b"event: progress\n", iter(stream.readline, b""))
            server.signal(signal.SIGTERM)
            server.process.wait(10)
            self.assertEqual(server.process.returncode, 0)
            for stream in streams:
                stream.read()  # to the end
