"""Every limit is a flag, its help says so, and an answer that refuses names its value."""
import re
import unittest

from serving import job, penumbra, serving

LIMITS = ["--max-body", "--max-json-depth", "--max-json-values", "--max-string", "--max-primitives", "--max-triangles",
          "--max-lights", "--max-polygon-vertices", "--max-edge-pixels", "--max-pixels", "--max-samples", "--max-depth",
          "--max-work", "--max-memory", "--job-time-limit", "--queue", "--queue-bytes", "--max-connections", "--max-streams",
          "--max-client-streams", "--max-head", "--request-timeout", "--idle-timeout", "--key-requests", "--key-jobs",
          "--keep-jobs", "--keep-images", "--keep-scenes"]
MESH = {"positions": [0, 0, 0, 1, 0, 0, 0, 1, 0], "indices": [0, 1, 2, 0, 1, 2]}
LIGHT = {"type": "point", "position": [0, 5, 0], "intensity": 1}
BALL = {"type": "sphere", "center": [0, 0, 0], "radius": 1}
POLYGON = {"type": "polygon", "vertices": [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]}


def scene(**fields):
    body = job()
    body["scene"].update(fields)
    return body


# flag, value, a body over it, the status, what the answer names
CASES = [
    ("--max-body", 500, job(threads=1) | {"x" * 600: 1}, 413, "500 bytes"),
    ("--max-json-depth", 3, scene(objects=[{"type": "group", "objects": [BALL]}]), 422, "more than 3 deep"),
    ("--max-json-values", 10, job(), 422, "10"),
    ("--max-string", 300, scene(name="x" * 301), 422, "300 bytes"),
    ("--max-primitives", 2, scene(objects=[BALL] * 3), 422, "more than 2 objects"),
    ("--max-triangles", 1, scene(meshes={"m": MESH}), 422, "more than 1 triangles"),
    ("--max-lights", 1, scene(lights=[LIGHT] * 2), 422, "more than 1 lights"),
    ("--max-polygon-vertices", 3, scene(objects=[POLYGON]), 422, "3"),
    ("--max-edge-pixels", 15, job(), 422, "1 to 15"),
    ("--max-pixels", 255, job(), 422, "255 pixels"),
    ("--max-samples", 63, job(shadow_samples=64), 422, "1 to 63"),
    ("--max-depth", 4, job(max_depth=5), 422, "0 to 4"),
    ("--max-work", 1000, job(), 422, "at most 1e+03"),
    ("--max-memory", 2000, job(), 422, "2000 bytes"),
]


class Limits(unittest.TestCase):
    def test_help_names_them_all(self):
        text = penumbra("serve", "--help").stdout
        for flag in LIMITS:
            self.assertIn(f"{flag} ", text)
            self.assertIn("PENUMBRA_" + flag[2:].replace("-", "_").upper(), text)

    def test_refusals_name_the_value(self):
        for flag, value, body, status, named in CASES:
            with self.subTest(flag), serving(flag, value) as server:
                answer = server.post("/v1/jobs", body)
                self.assertEqual(answer.status, status, answer.body)
                self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
                self.assertIn(named, answer.body.decode())
                self.assertEqual(server.get("/v1/jobs").json["jobs"], [])

    def test_the_environment_sets_them_too(self):
        with serving(environment={"PENUMBRA_MAX_DEPTH": "4"}) as server:
            self.assertEqual(server.post("/v1/jobs", job(max_depth=5)).status, 422)

    def test_the_head_has_a_budget(self):
        with serving("--max-head", 2048) as server:
            self.assertEqual(server.get("/healthz", headers={"X": "y" * 1000}).status, 200)
            answer = server.get("/healthz", headers={"X": "y" * 3000})
            self.assertEqual(answer.status, 431)
            self.assertIn("2048 bytes", answer.json["detail"])

    def test_no_job_may_ask_for_more_than_half_of_the_memory(self):
        total = int(next(line for line in open("/proc/meminfo") if line.startswith("MemTotal")).split()[1]) * 1024
        text = penumbra("serve", "--help").stdout
        default = re.search(r"--max-memory [^\n]*=(\d+) ", text)
        self.assertLessEqual(int(default[1]), total / 2)
