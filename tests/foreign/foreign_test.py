# SPDX-License-Identifier: GPL-3.0-or-later
"""A client that has none of our code and none of our protos: buf's generic gRPC client, through server reflection, in an
empty folder. NDMAP_BUF names the program."""
import base64
import json
import os
import shutil
import subprocess
import tempfile
import unittest

from programs import Cluster, run_ndmap

BUF = os.environ["NDMAP_BUF"]


class ForeignClientTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="ndmap-foreign-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        torus = os.path.join(cls.folder, "torus.off")
        run_ndmap("sample", "torus", "-o", torus, "--triangles", 2000)
        cls.cluster = Cluster(2)
        cls.addClassCleanup(cls.cluster.stop)
        cls.cluster.ndmap("create", "small", torus, "--grid", "6x6x3", "--blocks", 2)
        cls.cluster.ndmap("create", "large", torus, "--grid", "12x12x12", "--blocks", 3)
        cls.empty = os.path.join(cls.folder, "empty")
        os.mkdir(cls.empty)

    def buf(self, *arguments):
        return subprocess.run(
            [BUF, "curl", "--protocol", "grpc", "--http2-prior-knowledge", *arguments],
            cwd=self.empty, env={"PATH": os.environ["PATH"], "HOME": self.empty}, stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, check=False, timeout=60,
        )

    def messages(self, address, method, request):
        """All messages of the answer."""
        run = self.buf("--emit-defaults", "--data", json.dumps(request), f"http://{address}/ndmap.v1.{method}")
        self.assertEqual(run.returncode, 0, run.stderr)
        decoder, text, messages = json.JSONDecoder(), run.stdout.strip(), []
        while text:
            message, end = decoder.raw_decode(text)
            messages.append(message)
            text = text[end:].strip()
        return messages

    def call(self, address, method, request):
        messages = self.messages(address, method, request)
        self.assertEqual(len(messages), 1)
        return messages[0]

    def refused(self, address, method, request):
        """The code and the sentence."""
        run = self.buf("--data", json.dumps(request), f"http://{address}/ndmap.v1.{method}")
        self.assertNotEqual(run.returncode, 0)
        error = json.loads(run.stderr)
        return error["code"], error["message"]

    def servers(self, name):
        """The routing table."""
        found = self.call(self.cluster.address, "Coordinator/GetMap", {"map": name})["map"]
        self.assertEqual(found["state"], "MAP_STATE_READY")
        return [block["address"] for block in found["blocks"]]

    def beta(self, name, block, start, *word):
        answer = self.call(self.servers(name)[block], "BlockService/Beta", {
            "map": name, "block": block, "starts": [start], "word": base64.b64encode(bytes(word)).decode()})
        return answer["results"][0]

    def explore(self, name, **question):
        """The parts of the answer."""
        return self.messages(self.servers(name)[0], "BlockService/Explore", {"map": name, **question})

    def test_services_tell_what_they_are(self):
        for address, service in (
            (self.cluster.address, "ndmap.v1.Coordinator"),
            (self.servers("small")[0], "ndmap.v1.BlockService"),
        ):
            self.assertIn(service, self.buf("--list-services", f"http://{address}").stdout.split())

    def test_versions_are_exchanged(self):
        answer = self.call(self.cluster.address, "Coordinator/GetVersion", {"caller": {"protocol": 1, "program": "buf"}})
        self.assertEqual(answer["version"]["program"], "ndmap-coordinator")
        code, message = self.refused(self.cluster.address, "Coordinator/GetVersion", {"caller": {"protocol": 99}})
        self.assertEqual(code, "failed_precondition")
        self.assertIn("99", message)

    def test_maps_are_listed(self):
        maps = self.call(self.cluster.address, "Coordinator/ListMaps", {})["maps"]
        self.assertEqual([(m["map"], m["blockCount"]) for m in maps], [("large", 3), ("small", 2)])
        self.assertEqual(maps[1]["grid"]["cells"], [6, 6, 3])
        self.assertEqual(len(set(self.servers("small"))), 2)

    def test_betas_are_followed_across_blocks_and_servers(self):
        start = self.beta("small", 0, {"anyDart": True})["at"]["dart"]
        around = self.beta("small", 0, {"dart": start}, 1, 1, 1, 1)
        self.assertEqual((around["end"], around["used"]), ("WALK_END_ARRIVED", 4))
        self.assertEqual(around["at"]["dart"], start)
        # A face between two blocks, by its canonical dart.
        faces = self.explore("small", anchors=[{"block": 0}], give="GIVE_CELL_DETAILS", dimension=2)
        shared = next(face for part in faces for face in part["cells"] if face["blocks"] == [0, 1])
        block = shared["dart"]["block"]
        across = self.beta("small", block, {"dart": shared["dart"]}, 3)["at"]
        self.assertEqual(across["dart"]["block"], 1 - block)
        self.assertTrue(across["critical"])
        back = self.beta("small", block, {"dart": shared["dart"]}, 3, 2, 2, 3)["at"]
        self.assertEqual(back["dart"], shared["dart"])

    def test_an_orbit_is_streamed(self):
        # An inner vertex, of the hexahedra of both blocks: 24 darts, three of each of eight hexahedra.
        vertices = self.explore("small", anchors=[{"block": 0}], give="GIVE_CELL_DETAILS", dimension=0)
        inner = next(v for part in vertices for v in part["cells"] if v["blocks"] == [0, 1] and not v["boundary"])
        parts = self.explore("small", anchors=[{"cell": inner["id"]}], close=[0], give="GIVE_DARTS")
        orbit = [dart for part in parts for dart in zip(part["dartBlocks"], part["darts"])]
        self.assertEqual(len(set(orbit)), 24)
        self.assertEqual({block for block, _ in orbit}, {0, 1})
        self.assertEqual(inner["darts"], 24)
        # All darts of a map, in several messages.
        parts = self.explore("large", anchors=[{"block": b} for b in range(3)], give="GIVE_DARTS")
        self.assertGreater(len(parts), 1)
        darts = [dart for part in parts for dart in zip(part["dartBlocks"], part["darts"])]
        self.assertEqual(len(set(darts)), 24 * 12**3)
        self.assertEqual(darts, sorted(darts))

    def test_errors_are_codes_with_a_sentence(self):
        server = self.servers("small")[0]
        code, message = self.refused(self.cluster.address, "Coordinator/GetMap", {"map": "nowhere"})
        self.assertEqual(code, "not_found")
        self.assertIn("nowhere", message)
        dart = dict(self.beta("small", 0, {"anyDart": True})["at"]["dart"], version="1")
        code, message = self.refused(server, "BlockService/Beta", {"map": "small", "starts": [{"dart": dart}]})
        self.assertEqual(code, "failed_precondition")
        self.assertIn("ask for its darts again", message)
        question = {"map": "small", "anchors": [{"text": "h1/9"}], "give": "GIVE_DARTS"}
        code, message = self.refused(server, "BlockService/Explore", question)
        self.assertEqual(code, "invalid_argument")
        self.assertIn("expected the id of a cell", message)


if __name__ == "__main__":
    if not os.access(BUF, os.X_OK):
        raise SystemExit(f"{BUF} is missing: ./setup packages test installs it")
    unittest.main()
