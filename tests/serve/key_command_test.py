"""`penumbra key`, and a server that takes up what it changes."""
import signal
import stat
import tempfile
import unittest
from pathlib import Path

from serving import eventually, job, penumbra, serving


class Keys(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.file = Path(self.folder.name) / "keys"

    def create(self, *flags):
        made = penumbra("key", "create", "--keys", self.file, *flags)
        self.assertEqual(made.returncode, 0, made.stderr)
        return made.stdout.strip()

    def test_create_list_revoke(self):
        first = self.create("--owner", "alice")
        second = self.create("--owner", "bob", "--scopes", "metrics,admin", "--max-requests", 10, "--max-jobs", 2)
        self.assertRegex(first, r"^rs_[0-9a-z]{12}_[0-9a-z]{52}$")
        self.assertEqual(stat.S_IMODE(self.file.stat().st_mode), 0o600)
        text = self.file.read_text()
        for key in (first, second):
            self.assertNotIn(key.split("_")[2], text)
        ids = [key.split("_")[1] for key in (first, second)]
        self.assertEqual(penumbra("key", "list", "--keys", self.file).stdout.splitlines(),
                         [f"{ids[0]} alice jobs:read,jobs:write", f"{ids[1]} bob metrics,admin requests=10 jobs=2"])
        self.file.write_text("# ours\n" + text)
        self.assertEqual(penumbra("key", "revoke", ids[0], "--keys", self.file).returncode, 0)
        self.assertEqual(self.file.read_text(), "# ours\n" + text.splitlines()[1] + "\n")
        self.assertEqual(penumbra("key", "revoke", ids[0], "--keys", self.file).returncode, 2)

    def test_what_cannot_be_used(self):
        self.file.write_text("nonsense\n")
        for words in (["create", "--owner", "a b", "--keys", self.file], ["create", "--keys", self.file],
                      ["create", "--owner", "a", "--keys", self.file], ["list", "--keys", self.file],
                      ["create", "--owner", "a", "--scopes", "paint", "--keys", self.folder.name + "/x"],
                      ["list", "--keys", self.folder.name + "/none"], [], ["paint"]):
            self.assertEqual(penumbra("key", *words).returncode, 2, words)
        self.assertEqual(self.file.read_text(), "nonsense\n")
        for file in (self.file, self.folder.name + "/none"):
            self.assertEqual(penumbra("serve", "--listen", "127.0.0.1:0", "--keys", file).returncode, 2)

    def test_the_server_takes_up_changes(self):
        first = self.create("--owner", "alice")

        def status(server, key):
            return server.get("/v1/jobs", headers={"Authorization": f"Bearer {key}"}).status

        with serving("--keys", self.file) as server:
            self.assertEqual(server.get("/v1/jobs").status, 401)
            self.assertEqual(status(server, first), 200)
            second = self.create("--owner", "bob")
            self.assertTrue(eventually(lambda: status(server, second) == 200))
            penumbra("key", "revoke", first.split("_")[1], "--keys", self.file)
            server.signal(signal.SIGHUP)
            self.assertTrue(eventually(lambda: status(server, first) == 401))
            self.file.write_text("nonsense\n")
            server.signal(signal.SIGHUP)
            self.assertTrue(eventually(lambda: any("stay as they were" in entry.get("message", "")
                                                   for entry in server.log_entries())))
            self.assertEqual(status(server, second), 200)
            self.assertNotIn(second.split("_")[2], server.log_path.read_text())
            self.assertIn(second.split("_")[1], server.log_path.read_text())

    def test_others_may_reach_a_server_that_asks_for_keys(self):
        self.create("--owner", "alice")
        self.assertEqual(penumbra("serve", "--listen", "0.0.0.0:0").returncode, 2)
        self.assertEqual(penumbra("serve", "--listen", "0.0.0.0:0", "--admin-listen", "0.0.0.0:0", "--keys", self.file).returncode, 2)
        with serving("--keys", self.file, listen="0.0.0.0:0") as server:
            self.assertTrue(server.address.startswith("0.0.0.0:"))
            self.assertEqual(server.post("/v1/render", job()).status, 401)
