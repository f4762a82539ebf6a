# SPDX-License-Identifier: GPL-3.0-or-later
"""What the package makes of attributes on the wire, and of what comes back: also what a sound cluster would not say."""
import unittest

import grpc
import numpy as np

import ndmap
from fake_services import FakeServices, attribute
from ndmap.v1 import attributes_pb2 as pb
from ndmap.v1 import coordinator_pb2

ATTRIBUTES = [
    attribute("temperature", fill=pb.Values(doubles=[2.5])),
    attribute("wind", kind=pb.VALUE_TYPE_VEC3, split=pb.SPLIT_RULE_MEAN),
    attribute("age", 3, pb.VALUE_TYPE_INT64, fill=pb.Values(integers=[-7]), number=9),
    attribute("rock", 3, pb.VALUE_TYPE_CATEGORY, fill=pb.Values(codes=[0], categories=["chalk"])),
]
V, H = ndmap.CellIds.of(["v0:0", "v0:1", "v0:2"]), ndmap.CellIds.of(["h0", "h1", "h2"])


def part(ids, *columns, missing=()):
    return pb.ReadAttributesResponse(
        cell_hi=ids.hi.tolist(), cell_lo=ids.lo.tolist(), columns=columns, missing=missing
    )


class AttributesWireTest(unittest.TestCase):
    def setUp(self):
        self.fake = FakeServices(ATTRIBUTES)
        self.addCleanup(self.fake.stop)
        self.client = ndmap.connect(self.fake.address, ndmap.ClientOptions(first_pause=0.001))
        self.addCleanup(self.client.close)
        self.map = self.client.open_map("m")

    def fails(self, kind, pattern, call, *arguments, **options):
        with self.assertRaisesRegex(ndmap.NdmapError, pattern) as caught:
            call(*arguments, **options)
        self.assertIs(type(caught.exception), kind, caught.exception)
        self.assertNotIn("\n", str(caught.exception))

    def test_definitions_as_the_map_has_them(self):
        there = {each.name: each for each in self.map.attributes()}
        self.assertEqual(list(there), ["temperature", "wind", "age", "rock"])
        told = [(each.on, each.type, each.split, each.number) for each in there.values()]
        self.assertEqual(told, [("vertices", "double", "copy", 0), ("vertices", "vec3", "mean", 0),
                                ("hexahedra", "int64", "copy", 9), ("hexahedra", "category", "copy", 0)])
        self.assertEqual([each.fill for each in there.values()], [2.5, (0, 0, 0), -7, "chalk"])
        self.assertEqual(self.map.info.attributes, tuple(there.values()))

    def test_define_and_drop_are_jobs(self):
        self.fake.answers = [coordinator_pb2.DefineAttributeResponse(job=coordinator_pb2.Job(job=4)),
                             coordinator_pb2.DropAttributeResponse(job=coordinator_pb2.Job(job=5))]
        self.assertEqual(self.map.define("heat", on="vertices", type="vec3", split="mean", fill=(1, 2, 3)).id, 4)
        asked = self.fake.requests("DefineAttribute")[0]
        self.assertEqual(asked, pb.DefineAttributeRequest(map="m", attribute=pb.Attribute(
            name="heat", dimension=0, type=pb.VALUE_TYPE_VEC3, split=pb.SPLIT_RULE_MEAN,
            fill=pb.Values(doubles=[1, 2, 3]))))
        self.assertEqual(self.map.drop("heat").id, 5)
        self.assertEqual(self.fake.requests("DropAttribute"), [pb.DropAttributeRequest(map="m", name="heat")])

    def test_what_is_no_definition(self):
        for options, words in (
            ({"on": "cells"}, "'cells' is none of vertices, edges, faces, hexahedra"),
            ({"on": 4}, "dimension 4"),
            ({"on": 0, "type": "float"}, "type 'float' is none of double, int64, vec3, category"),
            ({"on": 0, "split": "half"}, "split 'half' is none of copy, mean"),
            ({"on": 0, "fill": "warm"}, "fill of attribute heat: values of type <U4, numbers expected"),
            ({"on": 0, "type": "int64", "fill": 0.5}, "whole numbers expected"),
            ({"on": 0, "type": "int64", "fill": 1 << 63}, "below 2.63"),
            ({"on": 0, "type": "vec3", "fill": (1, 2)}, r"shape \(2,\), \(1, 3\) or \(3,\) expected"),
            ({"on": 0, "type": "vec3", "fill": ((1, 2, 3), (4,))}, "heat"),
            ({"on": 0, "type": "category", "fill": 7}, "7, a text expected"),
            ({"on": 0, "type": "category", "fill": "é" * 33}, "of 66 bytes, at most 64"),
            ({"on": 0, "type": "category", "fill": "\ud800"}, "UTF-8"),
        ):
            with self.subTest(**options):
                self.fails(ndmap.InvalidArgumentError, words, self.map.define, "heat", **options)
        self.assertEqual(self.fake.asked, [])

    def test_columns_of_every_type(self):
        self.fake.answers = [
            [part(V[1:3], pb.Values(doubles=[1, 2]), pb.Values(doubles=range(6)), pb.Values(integers=[3, 4])),
             part(V[:1], pb.Values(doubles=[9]), pb.Values(doubles=[7, 8, 9]), pb.Values(integers=[5]))],
            [part(H[:2], pb.Values(codes=[1, 0], categories=["clay", "chalk"]), pb.Values(codes=[0, 0], categories=["cut"])),
             part(H[2:], pb.Values(codes=[0], categories=["sand"]), pb.Values(codes=[0], categories=["inside"]))],
        ]
        values = self.map.read("temperature", "@point", "@level")
        # Ascending by id, however the parts came.
        self.assertEqual(values.ids, V)
        np.testing.assert_array_equal(values["temperature"], [9.0, 1.0, 2.0])
        np.testing.assert_array_equal(values["@point"], [[7, 8, 9], [0, 1, 2], [3, 4, 5]])
        self.assertEqual((values["@level"].tolist(), values["@level"].dtype), ([5, 3, 4], np.int64))
        self.assertEqual(repr(values), "<CellValues 3 vertices: temperature, @point, @level>")
        rocks = self.map.read("rock", "@state")
        self.assertEqual(rocks["rock"].tolist(), ["chalk", "clay", "sand"])
        codes, texts = rocks.codes("rock")
        self.assertEqual([texts[code] for code in codes], ["chalk", "clay", "sand"])
        self.assertEqual(rocks["@state"].tolist(), ["cut", "cut", "inside"])
        self.assertEqual(rocks.rows(rocks["rock"] == "clay").ids.text(), ["h1"])
        asked = self.fake.requests("ReadAttributes")
        self.assertEqual([(one.dimension, list(one.names)) for one in asked],
                         [(0, ["temperature", "@point", "@level"]), (3, ["rock", "@state"])])
        self.assertTrue(all(one.select.HasField("all") and not one.select.by_level for one in asked))
        self.fails(ndmap.NotFoundError, "'age' was not read, but rock, @state", lambda: rocks["age"])
        self.fails(ndmap.InvalidArgumentError, "no categories", values.codes, "@point")

    def test_nothing_has_the_types_of_something(self):
        self.fake.answers = [[], [part(V[:0], pb.Values(), pb.Values())], [], []]
        for _ in range(2):
            values = self.map.read("temperature", "wind")
            self.assertEqual((len(values), values["temperature"].dtype, values["wind"].shape), (0, np.float64, (0, 3)))
        self.assertEqual(self.map.read("age")["age"].dtype, np.int64)
        rocks = self.map.read("rock")
        self.assertEqual((rocks["rock"].shape, rocks.codes("rock")[1]), ((0,), ()))
        self.assertEqual(len(self.map.read("temperature", ids=[])), 0)

    def test_which_cells(self):
        empty = [part(V[:0], pb.Values())]
        face = ndmap.CellIds.of(["f1:2"])
        self.fake.answers = [empty] * 6 + [[part(face, pb.Values(doubles=[0, 0, 0]), missing=[0])]]
        self.map.read("temperature", levels=2)
        self.map.read("temperature", levels=(1, 3))
        self.map.read("temperature", box=((0, 0, 0), (1, 1, 1)))
        self.map.read("age", box=((0, 0, 0), (1, 1, 1)))
        self.map.read("temperature", where=["h3", ndmap.PointAnchor((1, 2, 3))], close="3")
        self.map.read("@point", on="edges")
        self.assertEqual(len(self.map.read("@point", ids="f1:2", skip_missing=True)), 0)
        asked = self.fake.requests("ReadAttributes")
        self.assertEqual([one.dimension for one in asked], [0, 0, 0, 3, 0, 1, 2])
        levels = [(one.select.by_level, one.select.lowest_level, one.select.highest_level) for one in asked[:2]]
        self.assertEqual(levels, [(True, 2, 2), (True, 1, 3)])
        self.assertEqual([list(one.select.query.close) for one in asked[2:5]], [[3], [], [3]])
        self.assertEqual(asked[2].select.query.anchors[0].box.hi.z, 1)
        self.assertEqual([each.WhichOneof("at") for each in asked[4].select.query.anchors], ["cell", "point"])
        for names, options, words in (
            ((), {}, "names of attributes expected"),
            (("@colour",), {"on": 0}, "'@colour' is none of @point, @level"),
            (("@point",), {}, "of which cells"),
            (("temperature", "age"), {}, r"temperature \(vertices\), age \(hexahedra\)"),
            (("temperature", "@state"), {}, r"temperature \(vertices\), @state \(hexahedra\)"),
            (("temperature",), {"on": "edges"}, r"on='edges' \(edges\), temperature \(vertices\)"),
            (("age",), {"ids": "h0", "levels": 1}, "ids and levels exclude each other"),
            (("age",), {"close": "3"}, "close goes with where"),
            (("age",), {"box": 7}, "two points"),
            (("age",), {"levels": (1, 2, 3)}, "the lowest and the highest"),
            (("age",), {"levels": -1}, "a level"),
            (("age",), {"ids": 7}, "ids of cells expected"),
            (("age",), {"ids": ["x"]}, "expected the id of a cell"),
            (("age",), {"where": []}, "one anchor or more"),
        ):
            with self.subTest(names=names, **options):
                self.fails(ndmap.InvalidArgumentError, words, self.map.read, *names, **options)
        self.fails(ndmap.NotFoundError, "no attribute 'heat', it has age, rock, temperature, wind", self.map.read, "heat")
        self.assertEqual(len(self.fake.requests("ReadAttributes")), 7)

    def test_ids_keep_their_order_and_say_which_are_missing(self):
        answer = [part(V[[2, 0, 1]], pb.Values(doubles=[3, 1, 2]), missing=[1])]
        self.fake.answers = [answer, answer, [part(V[[2, 0]], pb.Values(doubles=[3, 1]))]]
        self.fails(ndmap.NotFoundError, "no v0:0: 1 of 3 cells are not there", self.map.read, "temperature",
                   ids=["v0:2", "v0:0", "v0:1"])
        values = self.map.read("temperature", ids=V[[2, 0, 1]], skip_missing=True)
        self.assertEqual((values.ids.text(), values["temperature"].tolist()), (["v0:2", "v0:1"], [3.0, 2.0]))
        self.assertEqual(self.map.read("temperature", ids=V[[2, 0]])["temperature"].tolist(), [3.0, 1.0])

    def test_many_ids_go_in_parts(self):
        ids = ndmap.CellIds.from_words(np.zeros(150_000, np.uint64), np.arange(150_000, dtype=np.uint64) + (1 << 31))
        values = np.arange(150_000) / 8
        parts = [slice(first, first + 65536) for first in range(0, 150_000, 65536)]
        self.fake.answers = [pb.WriteAttributeResponse(written=149_998, missing=2, missing_ids=["v0#1", "v0#2"])]
        self.fake.answers += [[part(ids[each], pb.Values(doubles=values[each]))] for each in parts]
        written = self.map.write("temperature", ids, values)
        self.assertEqual(written, ndmap.Written(149_998, 2, ("v0#1", "v0#2")))
        first, *messages = self.fake.requests("WriteAttribute")[0]
        self.assertEqual(first, pb.WriteAttributeRequest(map="m", name="temperature"))
        self.assertEqual([len(one.ids.hi) for one in messages], [65536, 65536, 18928])
        self.assertEqual([x for one in messages for x in one.values.doubles], values.tolist())
        np.testing.assert_array_equal(self.map.read("temperature", ids=ids)["temperature"], values)
        self.assertEqual([len(one.select.ids.lo) for one in self.fake.requests("ReadAttributes")], [65536, 65536, 18928])

    def test_values_of_every_type_are_written(self):
        self.fake.answers = [pb.WriteAttributeResponse(written=3)] * 6
        self.map.write("wind", V, np.arange(9).reshape(3, 3))
        self.map.write("wind", V, (1, 2, 3))
        self.map.write("age", H, np.array([1, 2, 3], np.uint8))
        self.map.write("rock", H, np.array(["clay", "chalk", "clay"]))
        self.map.write("rock", ["h0", "h1"], "sand")
        self.map.set("rock", "clay", levels=1)
        sent = [messages[-1].values for messages in self.fake.requests("WriteAttribute")]
        self.assertEqual(sent[0].doubles, list(range(9)))
        self.assertEqual(sent[1].doubles, [1, 2, 3] * 3)
        self.assertEqual(sent[2].integers, [1, 2, 3])
        self.assertEqual([sent[3].categories[code] for code in sent[3].codes], ["clay", "chalk", "clay"])
        self.assertEqual((sent[4].codes, sent[4].categories), ([0, 0], ["sand"]))
        only, = self.fake.requests("WriteAttribute")[5]
        self.assertEqual((only.map, only.name, only.select.lowest_level, list(only.values.categories)),
                         ("m", "rock", 1, ["clay"]))
        self.fails(ndmap.InvalidArgumentError, r"attribute temperature: values of the shape \(2,\), \(3,\)",
                   self.map.write, "temperature", V, [1, 2])
        self.fails(ndmap.InvalidArgumentError, "2 texts, 3 or one", self.map.write, "rock", H, ["a", "b"])
        self.fails(ndmap.InvalidArgumentError, "whole numbers", self.map.write, "age", H, [1, 2, 3.5])
        self.fails(ndmap.NotFoundError, "no attribute 'heat'", self.map.write, "heat", V, 0)

    def test_computed_from_other_columns(self):
        self.fake.answers = [[part(V, pb.Values(doubles=range(9)), pb.Values(integers=[1, 2, 3]))],
                             pb.WriteAttributeResponse(written=3)]
        done = self.map.compute("temperature", lambda point, level: point[:, 2] * level, "@point", "@level")
        self.assertEqual(done.written, 3)
        sent = self.fake.requests("WriteAttribute")[0][-1]
        self.assertEqual((list(sent.ids.lo), list(sent.values.doubles)), (V.lo.tolist(), [2, 10, 24]))

    def test_a_write_is_sent_again_until_the_map_is_up_to_date(self):
        refusals = [(grpc.StatusCode.ABORTED, "being brought up to date")] * 5
        refusals += [(grpc.StatusCode.UNAVAILABLE, "gone")] * 2
        self.fake.answers = refusals + [pb.WriteAttributeResponse(written=3)]
        self.assertEqual(self.map.write("temperature", V, 1).written, 3)
        sent = self.fake.requests("WriteAttribute")
        self.assertEqual(len(sent), 8)
        self.assertTrue(all(messages == sent[0] and len(messages) == 2 for messages in sent))
        self.fake.answers = refusals + [[part(V, pb.Values(doubles=[1, 2, 3]))]]
        self.assertEqual(len(self.map.read("temperature")), 3)
        self.fake.answers = refusals + [pb.AggregateResponse()]
        self.assertEqual(self.map.aggregate("temperature").count, 0)

    def test_a_map_that_is_never_up_to_date(self):
        with ndmap.connect(self.fake.address, ndmap.ClientOptions(first_pause=0.001, call_timeout=2.0)) as client:
            self.fake.answers = [(grpc.StatusCode.ABORTED, "being brought up to date")] * 1000
            self.fails(ndmap.AbortedError, "up to date", client.open_map("m").write, "temperature", V, 1)
        self.assertGreater(len(self.fake.requests("WriteAttribute")), 1)
        self.fake.answers = [(grpc.StatusCode.UNAVAILABLE, "gone")] * 9
        self.fails(ndmap.UnavailableError, "gone", self.map.read, "temperature")
        self.assertEqual(len(self.fake.answers), 6)

    def test_answers_that_make_no_sense(self):
        for columns, words in (
            ([pb.Values(doubles=[1, 2])], "2 numbers for 3 cells"),
            ([], "0 columns"),
            ([pb.Values(doubles=[1, 2, 3])] * 2, "2 columns"),
        ):
            self.fake.answers = [[part(V, *columns)]]
            self.fails(ndmap.InternalError, words, self.map.read, "temperature")
        self.fake.answers = [[part(H, pb.Values(codes=[0, 5, 0], categories=["clay"]))]]
        self.fails(ndmap.InternalError, "category 5, it came with 1", self.map.read, "rock")
        self.fake.answers = [[part(V, pb.Values(doubles=[1, 2, 3]), missing=[3])]]
        self.fails(ndmap.InternalError, "missing", self.map.read, "temperature", ids=V)
        answer = part(V, pb.Values(doubles=[1, 2, 3]))
        del answer.cell_lo[0]
        self.fake.answers = [[answer]]
        self.fails(ndmap.InternalError, "3 upper and 2 lower words", self.map.read, "temperature")
        self.fake.answers = [[part(V[:1], pb.Values(doubles=[1]))]]
        self.fails(ndmap.InternalError, "1 cells, 3 were asked for", self.map.read, "temperature", ids=V)

    def test_aggregates(self):
        one = pb.Aggregate(count=4, not_finite=[1], sum=[6.0], min=[1], max=[3], integral=[12.5], volume=8.0,
                           histogram=[1, 0, 2], below=[0], above=[0])
        three = pb.Aggregate(group="1", count=2, not_finite=[0, 0, 0], sum=[1, 2, 3], min=[0, 0, 0], max=[1, 2, 3],
                             histogram=[1, 1, 0, 2, 2, 0], below=[0, 0, 0], above=[0, 0, 0])
        whole = pb.Aggregate(group="clay", count=3, not_finite=[0], sum=[2.0**62], integer_sum=(1 << 62) + 1,
                             min=[0], max=[9])
        self.fake.answers = [pb.AggregateResponse(groups=groups)
                             for groups in ([one], [three], [whole], [pb.Aggregate(count=7)], [])]
        result = self.map.aggregate("temperature", histogram=(3, 0.0, 3.0), integral=True)
        self.assertEqual((result.count, result.not_finite, result.sum, result.mean, result.min, result.max), (4, 1, 6, 2, 1, 3))
        self.assertEqual((result.integral, result.volume, result.below, result.above), (12.5, 8, 0, 0))
        self.assertEqual((result.histogram.tolist(), result.edges.tolist()), ([1, 0, 2], [0, 1, 2, 3]))
        by_level = self.map.aggregate("wind", by="level", histogram=(2, 0, 1), levels=(0, 2))
        self.assertEqual(list(by_level), [1])
        self.assertEqual(by_level[1].mean.tolist(), [0.5, 1, 1.5])
        self.assertEqual(by_level[1].histogram.tolist(), [[1, 1], [0, 2], [2, 0]])
        self.assertEqual(self.map.aggregate("age", by="category:rock")["clay"].sum, (1 << 62) + 1)
        counted = self.map.aggregate(on="hexahedra")
        self.assertEqual((counted.count, counted.sum, counted.mean, counted.volume), (7, None, None, None))
        self.assertEqual(self.map.aggregate(by="block", on=3), {})
        asked = self.fake.requests("Aggregate")
        self.assertEqual([(each.dimension, each.name, each.group_by, each.category) for each in asked],
                         [(0, "temperature", pb.GROUP_BY_NOTHING, ""), (0, "wind", pb.GROUP_BY_LEVEL, ""),
                          (3, "age", pb.GROUP_BY_CATEGORY, "rock"), (3, "", pb.GROUP_BY_NOTHING, ""),
                          (3, "", pb.GROUP_BY_BLOCK, "")])
        self.assertEqual((asked[0].bins, asked[0].histogram_hi, asked[0].integral), (3, 3.0, True))
        self.assertEqual((asked[1].by_level, asked[1].highest_level), (True, 2))
        for options, words in (
            ({"name": "age", "histogram": 5}, r"\(bins, lo, hi\) expected"),
            ({"name": "age", "histogram": (0, 0, 1)}, "1 ... 65536 bins"),
            ({"name": "age", "histogram": (65537, 0, 1)}, "1 ... 65536 bins"),
            ({"name": "age", "histogram": (3, 1, 1)}, "a higher hi"),
            ({"name": "age", "histogram": (3, 0, float("nan"))}, "a higher hi"),
            ({"name": "age", "by": 3}, "by=3: 'level', 'block' or 'category:NAME'"),
            ({"name": "age", "by": []}, "'level', 'block'"),
            ({"name": "age", "by": "rock"}, "'level', 'block'"),
            ({"name": "age", "by": "category:"}, "'level', 'block'"),
            ({"name": "age", "by": "level:rock"}, "'level', 'block'"),
            ({"name": "age", "by": "category:temperature"}, r"age \(hexahedra\), temperature \(vertices\)"),
            ({}, "of which cells"),
        ):
            with self.subTest(**options):
                self.fails(ndmap.InvalidArgumentError, words, self.map.aggregate, **options)


if __name__ == "__main__":
    unittest.main()
