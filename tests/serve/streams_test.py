"""What stands around a server: the three standard streams, whoever reads its log, the terminal that hangs up."""
import http.client
import os
import re
import signal
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from serving import BIN, PATIENCE_S, eventually, penumbra, serving


def answer_of(address, path):
    connection = http.client.HTTPConnection(address, timeout=PATIENCE_S)
    try:
        connection.request("GET", path)
        return connection.getresponse().read().decode()
    finally:
        connection.close()


class Streams(unittest.TestCase):
    def start(self, folder, error, **more):
        process = subprocess.Popen([BIN / "penumbra", "serve", "--listen", "127.0.0.1:0", "--store", f"{folder}/store"],
                                   stdout=subprocess.PIPE, stderr=error, text=True, **more)
        self.addCleanup(process.stdout.close)
        self.addCleanup(process.wait)
        self.addCleanup(process.kill)
        return process

    def test_a_log_that_nobody_reads_stops_nothing(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        reader, writer = os.pipe()
        self.addCleanup(os.close, reader)
        process = self.start(folder.name, writer)
        os.close(writer)
        address = process.stdout.readline().strip().rsplit("http://", 1)[1]

        # More lines than a pipe and the server's own memory for them hold.
        connection = http.client.HTTPConnection(address, timeout=PATIENCE_S)
        self.addCleanup(connection.close)
        count = dropped = 0
        while dropped == 0 and count < 20_000:
            count += 1
            connection.request("GET", "/" + "x" * 150)
            connection.getresponse().read()
            if count % 500 == 0:
                metrics = answer_of(address, "/metrics")
                dropped = int(re.search(r"^penumbra_log_dropped_lines_total (\d+)$", metrics, re.MULTILINE)[1])
        self.assertGreater(dropped, 0)
        # Once somebody reads, a line says how many are missing, and those after it come again.
        text = b""
        os.set_blocking(reader, False)

        def is_told():
            nonlocal text
            try:
                while more := os.read(reader, 1 << 20):
                    text += more
            except BlockingIOError:
                pass
            return re.search(rb'"message":"\d+ lines of the log were dropped', text) is not None

        self.assertTrue(eventually(is_told))
        answer_of(address, "/healthz?after")
        self.assertTrue(eventually(lambda: is_told() and b"/healthz?after" in text))
        self.assertTrue(all(line.startswith(b"{") and line.endswith(b"}") for line in text.splitlines()))

    def test_sigterm_ends_a_server_whose_log_nobody_reads(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        reader, writer = os.pipe()
        self.addCleanup(os.close, reader)
        # No room for a single line.
        os.set_blocking(writer, False)
        try:
            while os.write(writer, b"x" * 4096):
                pass
        except BlockingIOError:
            pass
        os.set_blocking(writer, True)
        process = self.start(folder.name, writer)
        os.close(writer)
        address = process.stdout.readline().strip().rsplit("http://", 1)[1]
        self.assertIn("ok", answer_of(address, "/healthz"))
        process.send_signal(signal.SIGTERM)
        self.assertEqual(process.wait(10), 0)

    def test_without_streams_no_log_gets_into_the_store(self):
        with tempfile.TemporaryDirectory() as folder:
            command = f'exec "{BIN}/penumbra" serve --listen 127.0.0.1:0 --store "{folder}/store" <&- >&- 2>&-'
            process = subprocess.Popen(["/bin/sh", "-c", command])
            try:
                self.assertTrue(eventually(lambda: Path(folder, "store/penumbra.db").exists()))
                time.sleep(0.5)
                streams = [os.readlink(f"/proc/{process.pid}/fd/{number}") for number in range(3)]
                self.assertEqual(streams, ["/dev/null"] * 3)
            finally:
                process.terminate()
                self.assertEqual(process.wait(PATIENCE_S), 0)
            for file in Path(folder).rglob("*"):
                if file.is_file():
                    self.assertNotIn(b"render threads", file.read_bytes(), file)
                    self.assertNotIn(b"listening on", file.read_bytes(), file)

    def test_a_hang_up_ends_a_server_without_keys(self):
        with serving() as server:
            server.signal(signal.SIGHUP)
            self.assertEqual(server.process.wait(10), 0)

    def test_a_hang_up_reads_the_keys_of_one_that_has_some(self):
        with tempfile.TemporaryDirectory() as folder:
            keys = Path(folder, "keys")
            text = penumbra("key", "create", "--owner", "alice", "--keys", keys).stdout.strip()
            full = keys.read_text()

            def status(server):
                return server.get("/v1/jobs", headers={"Authorization": f"Bearer {text}"}).status

            with serving("--keys", keys) as server:
                self.assertEqual(status(server), 200)
                for count, broken in enumerate(("", "\n \n", full.rstrip("\n"), full[:40])):
                    keys.write_text(broken)
                    server.signal(signal.SIGHUP)
                    self.assertTrue(eventually(lambda: sum("stay as they were" in entry.get("message", "")
                                                           for entry in server.log_entries()) > count), broken)
                    self.assertEqual(status(server), 200)
                # That there is to be no key any more is said in words.
                keys.write_text(full)
                self.assertEqual(penumbra("key", "revoke", text.split("_")[1], "--keys", keys).returncode, 0)
                self.assertTrue(eventually(lambda: status(server) == 401))
            keys.write_text("")
            self.assertEqual(penumbra("serve", "--listen", "127.0.0.1:0", "--keys", keys).returncode, 2)

    def test_origins_are_written_as_browsers_do(self):
        for wrong, right in {"https://example.org/": "https://example.org", "https://Example.org": "https://example.org",
                             "https://example.org:443": "https://example.org", "http://example.org:80": "http://example.org",
                             "HTTP://[::1]:080/a?b#c": "http://[::1]", "https://example.org:8443/x": "https://example.org:8443"}.items():
            refused = penumbra("serve", "--listen", "127.0.0.1:0", "--cors-origin", wrong)
            self.assertEqual(refused.returncode, 2, wrong)
            self.assertTrue(refused.stderr.strip().endswith(" as " + right), refused.stderr)
        for nonsense in ("example.org", "https://", "https://a b", "https://a:b", "https://a:99999", "https://user@a", ""):
            refused = penumbra("serve", "--listen", "127.0.0.1:0", "--cors-origin", nonsense)
            self.assertEqual(refused.returncode, 2, nonsense)
        with serving("--cors-origin", "https://example.org,http://[::1]:8080,http://localhost:3000") as server:
            for origin in ("https://example.org", "http://[::1]:8080", "http://localhost:3000"):
                self.assertEqual(server.get("/healthz", headers={"Origin": origin}).headers["Access-Control-Allow-Origin"], origin)
