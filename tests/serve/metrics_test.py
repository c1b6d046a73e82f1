"""Metrics: names and units as Prometheus wants them, and a dashboard that asks for nothing else."""
import json
import re
import subprocess
import unittest

from serving import ENDLESS, ROOT, eventually, job, serving

DASHBOARD = ROOT / "docker/grafana/penumbra.json"


def busy(server):
    """Something of everything: jobs that succeed, fail and are canceled, a stream, refusals."""
    assert server.post("/v1/render", job(shadow_samples=4)).status == 200
    endless = server.submit(ENDLESS)
    stream = server.open_events(endless)
    assert stream.status == 200
    assert server.get("/nothing").status == 404
    assert server.post("/v1/jobs", {}).status == 422
    server.post(f"/v1/jobs/{endless}/cancel", "")
    assert eventually(lambda: server.get(f"/v1/jobs/{endless}").json["state"] == "canceled")
    stream.close()


class Metrics(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        with serving("--admin-listen", "127.0.0.1:0") as server:
            busy(server)
            answer = server.get("/metrics", address=server.admin)
            cls.type, cls.text = answer.headers["Content-Type"], answer.body.decode()
            cls.main_text = server.get("/metrics").body.decode()

    def value(self, sample):
        found = re.search(rf"^{re.escape(sample)} (\S+)$", self.text, re.MULTILINE)
        self.assertIsNotNone(found, f"{sample} is not in\n{self.text}")
        return float(found[1])

    def test_promtool_has_nothing_to_say(self):
        self.assertTrue(self.type.startswith("text/plain; version=0.0.4"))
        checked = subprocess.run(["promtool", "check", "metrics"], input=self.text, capture_output=True, text=True)
        self.assertEqual((checked.returncode, checked.stdout + checked.stderr), (0, ""))

    def test_what_happened_was_counted(self):
        self.assertEqual(self.value('penumbra_jobs_ended_total{state="succeeded"}'), 1)
        self.assertEqual(self.value('penumbra_jobs_ended_total{state="canceled"}'), 1)
        self.assertEqual(self.value("penumbra_jobs_accepted_total"), 2)
        self.assertEqual(self.value('penumbra_jobs{state="queued"}'), 0)
        self.assertEqual(self.value("penumbra_queue_wait_seconds_count"), 2)
        self.assertEqual(self.value("penumbra_render_seconds_count"), 1)
        self.assertGreater(self.value("penumbra_render_seconds_sum"), 0)
        self.assertEqual(self.value("penumbra_estimated_error_count"), 1)
        self.assertEqual(self.value('penumbra_rays_total{kind="camera"}'), 256)
        self.assertEqual(self.value('penumbra_http_requests_total{code="404",method="GET",route="none"}'), 1)
        self.assertEqual(self.value('penumbra_http_requests_total{code="422",method="POST",route="/v1/jobs"}'), 1)
        self.assertEqual(self.value('penumbra_http_request_duration_seconds_count{code="200",route="/v1/render"}'), 1)
        self.assertEqual(self.value('penumbra_store_operation_duration_seconds_count{operation="create"}'), 2)
        self.assertEqual(self.value("penumbra_queue_limit"), 256)
        self.assertGreater(self.value("process_resident_memory_bytes"), 1e6)
        self.assertGreater(self.value("process_open_fds"), 3)

    def test_both_addresses_tell_the_same(self):
        names = [set(re.findall(r"^# TYPE (\S+)", text, re.MULTILINE)) for text in (self.text, self.main_text)]
        self.assertEqual(names[0], names[1])

    def test_clients_do_not_make_labels(self):
        """Paths and methods that nobody knows are one series, however many there are."""
        with serving() as server:
            for i in range(20):
                server.get(f"/nothing/{i}")
                server.call("DELETE", f"/v1/jobs/{i}")
            text = server.get("/metrics").body.decode()
        self.assertIn('penumbra_http_requests_total{code="404",method="GET",route="none"} 20', text)
        self.assertIn('penumbra_http_requests_total{code="404",method="DELETE",route="/v1/jobs/{id}"} 20', text)

    def test_every_query_of_the_dashboard_names_metrics_that_exist(self):
        known = set(re.findall(r"^([a-z_]+)[{ ]", self.text, re.MULTILINE))
        panels = json.loads(DASHBOARD.read_text())["panels"]
        queries = [target["expr"] for panel in panels for target in panel.get("targets", [])]
        self.assertGreater(len(queries), 10)
        asked = set()
        for query in queries:
            names = set(re.findall(r"\b(?:penumbra|process)_[a-z_]+", query))
            self.assertTrue(names, query)
            asked |= names
            self.assertEqual(names - known, set(), query)
            # The parser of rules is the one that promtool has.
            rule = json.dumps({"groups": [{"name": "g", "rules": [{"record": "a:b", "expr": query.replace("$__rate_interval", "5m")}]}]})
            checked = subprocess.run(["promtool", "check", "rules", "/dev/stdin"], input=rule, capture_output=True, text=True)
            self.assertEqual(checked.returncode, 0, f"{query}: {checked.stderr}")
        families = {re.sub("_(bucket|sum|count)$", "", name) for name in known if name.startswith("penumbra_")}
        shown = {re.sub("_(bucket|sum|count)$", "", name) for name in asked}
        self.assertEqual(families - shown, set(), "metrics that no panel shows")
