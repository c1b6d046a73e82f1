"""Whom a server without keys answers, so that no page on the web reaches it by a name of its own (DNS rebinding)."""
import unittest

from serving import job, penumbra, serving


class Host(unittest.TestCase):
    def status(self, server, host, address=None):
        return server.get("/healthz", headers={"Host": host}, address=address).status

    def test_on_this_machine_only_its_names_and_those_that_are_told(self):
        with serving("--admin-listen", "127.0.0.1:0", "--host", "render.example.org,[2001:db8::1]") as server:
            for address in (server.address, server.admin):
                for host in ("127.0.0.1", "localhost", "[::1]:8080", "127.8.9.10:1", "Render.Example.Org", "[2001:db8::1]"):
                    self.assertEqual(self.status(server, host, address), 200, host)
                for host in ("evil.example", "192.168.1.2", "localhost.evil.example", "render.example.org.evil.example"):
                    self.assertEqual(self.status(server, host, address), 421, host)
            answer = server.post("/v1/render", job(), headers={"Host": "evil.example"})
            self.assertEqual((answer.status, answer.json["type"]), (421, "/problems/misdirected"))
            self.assertIn("--host", answer.json["detail"])

    def test_where_others_reach_it_addresses_as_well(self):
        with serving("--allow-public", listen="0.0.0.0:0") as server:
            server.address = "127.0.0.1:" + server.address.rsplit(":", 1)[1]
            for host, status in (("192.168.1.2", 200), ("[fe80::1]", 200), ("evil.example", 421)):
                self.assertEqual(self.status(server, host), status, host)

    def test_names_that_are_none(self):
        for name in ("render.example.org:80", "http://render.example.org", "a b", "::x", "a:"):
            refused = penumbra("serve", "--listen", "127.0.0.1:0", "--host", name)
            self.assertEqual((refused.returncode, "--host: " in refused.stderr), (2, True), name)
