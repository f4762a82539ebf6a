// SPDX-License-Identifier: GPL-3.0-or-later
// Attributes of cells of every dimension through random refinements and removals, in random blocks.
#include <gtest/gtest.h>

#include <array>
#include <bit>
#include <map>
#include <random>
#include <set>

#include "absl/strings/str_join.h"
#include "core/attributes/aggregate.h"
#include "core/names/hexahedron_lattice.h"
#include "tests/property/property_case.h"

namespace ndmap {
namespace {

using reference::MakeRandomCase;
using reference::RandomCase;
using Map = SimulatedMap<Block3>;
// By cell, the values of its dimension's columns, one after the other; categories as hashes of their texts.
using Values = std::map<CellId, std::vector<uint64_t>>;

uint64_t Word(double value) { return std::bit_cast<uint64_t>(value); }
double Real(uint64_t word) { return std::bit_cast<double>(word); }

AttributeDefinition Definition(const std::string& name, unsigned dimension, ValueType type, SplitRule split) {
  static uint64_t number = 0;
  AttributeDefinition d{name, dimension, type, split, {}, "", ++number};
  if (type == ValueType::kDouble) d.fill = {Word(0.5), 0, 0};
  if (type == ValueType::kInt64) d.fill = {7, 0, 0};
  if (type == ValueType::kVec3) d.fill = {Word(1), Word(2), Word(4)};
  if (type == ValueType::kCategory) d.fill_text = "first";
  return d;
}

std::vector<AttributeDefinition> EveryKind() {
  std::vector<AttributeDefinition> all;
  for (unsigned i = 0; i < 4; ++i) {
    for (ValueType type : {ValueType::kDouble, ValueType::kInt64, ValueType::kVec3, ValueType::kCategory}) {
      for (SplitRule split :
           {SplitRule::kCopy, SplitRule::kMean, SplitRule::kMidpoint, SplitRule::kZero, SplitRule::kDivide}) {
        AttributeDefinition d = Definition(
            absl::StrCat("a", i, ".", static_cast<int>(type), ".", static_cast<int>(split)), i, type, split);
        if (Validate(d).ok()) all.push_back(d);
      }
    }
  }
  return all;
}

absl::StatusOr<Report> Update(Map& map, const std::vector<AttributeDefinition>& definitions) {
  return map.Run("attributes", Parameters().Set("definitions", EncodeDefinitions(definitions)));
}

absl::StatusOr<std::unique_ptr<Map>> Build(const RandomCase& c, uint32_t blocks, Routing routing) {
  auto map = std::make_unique<Map>(blocks, routing, SimulatorOptions{c.seed});
  std::vector<uint32_t> block_of = c.block_of;
  for (uint32_t& b : block_of) b %= blocks;
  auto corner = [&c](uint32_t i, uint32_t j, uint32_t k) { return c.Corner(i, j, k); };
  if (absl::Status s = map->BuildGrid(c.grid, corner, block_of); !s.ok()) return s;
  return map;
}

absl::Status Refine(Map& map, const std::vector<CellId>& list) {
  if (list.empty()) return absl::OkStatus();
  const std::string cells = absl::StrJoin(
      list, " ", [](std::string* out, const CellId& id) { absl::StrAppend(out, id.ToString()); });
  return map
      .Run("refine", Parameters()
                         .Set("oracle", "list")
                         .Set("cells", cells)
                         .Set("depth", int64_t{RandomCase::kMaxLevel + 1}))
      .status();
}

// A value for a cell that depends on nothing but the cell, the column and a salt: as one writer would write
// it to every block.
void WriteAll(Map& map, uint64_t salt) {
  for (size_t b = 0; b < map.blocks().size(); ++b) {
    for (unsigned i = 0; i < 4; ++i) {
      AttributeTable& table = map.attributes(b).table(i);
      for (uint32_t row = 0; row < table.size(); ++row) {
        const CellId id = table.id(row);
        for (auto& column : table.columns()) {
          std::mt19937_64 random(id.hi() * 31 + id.lo() * 17 + salt + column->definition().number);
          ValueWords value{};
          for (unsigned c = 0; c < column->width(); ++c) {
            value[c] = column->definition().type == ValueType::kInt64
                           ? random()
                           : Word(std::ldexp(static_cast<double>(random() >> 11), -40));
          }
          if (column->definition().type == ValueType::kCategory)
            value = {column->Code(absl::StrCat("category ", random() % 5)).value(), 0, 0};
          column->Set(row, value);
        }
      }
    }
  }
}

// All rows of all blocks; a cell in several blocks must have the same values in each, and count once.
void Collect(Map& map, std::array<Values, 4>& values) {
  for (unsigned i = 0; i < 4; ++i) {
    std::map<CellId, int> counted;
    for (size_t b = 0; b < map.blocks().size(); ++b) {
      const AttributeTable& table = map.attributes(b).table(i);
      EXPECT_TRUE(map.attributes(b).CheckReadable().ok());
      for (uint32_t row = 0; row < table.size(); ++row) {
        std::vector<uint64_t> words;
        for (const auto& column : table.columns()) {
          ValueWords value = column->Get(row);
          if (column->definition().type == ValueType::kCategory)
            value = {std::hash<std::string>()(column->Text(value[0])), 0, 0};
          words.insert(words.end(), value.begin(), value.begin() + column->width());
        }
        const CellId id = table.id(row);
        const auto [it, made] = values[i].try_emplace(id, words);
        EXPECT_EQ(it->second, words) << id.ToString() << " in block " << b;
        counted[id] += table.Is(row, AttributeTable::kElsewhere) ? 0 : 1;
        EXPECT_EQ(table.Find(id), row);
      }
    }
    for (const auto& [id, times] : counted) EXPECT_EQ(times, 1) << id.ToString();
  }
}

// The ids of all cells, by the map itself.
std::array<std::set<CellId>, 4> CellsOf(Map& map, const InitialCells& initial) {
  std::array<std::set<CellId>, 4> cells;
  for (auto& block : map.blocks()) {
    HexahedronLattice<Block3> lattice(block->map());
    auto& hexahedra = block->map().attributes<3>();
    for (auto it = hexahedra.begin(); it != hexahedra.end(); ++it) {
      cells[3].insert(block->map().info_of_attribute<3>(it).id);
      for (const auto& placed : lattice.Of(it)) {
        cells[0].insert(NameOf(initial, placed.vertex));
        cells[1].insert(NameOf(initial, placed.edge));
        cells[2].insert(NameOf(initial, placed.face));
      }
    }
  }
  return cells;
}

class AttributesTest : public testing::TestWithParam<uint64_t> {};

TEST_P(AttributesTest, SameValuesWhateverTheBlocks) {
  const RandomCase c = MakeRandomCase(GetParam());
  SCOPED_TRACE(c.Describe());
  const std::vector<AttributeDefinition> definitions = EveryKind();
  const auto half = c.refined.begin() + static_cast<std::ptrdiff_t>(c.refined.size() / 2);
  std::array<std::array<Values, 4>, 2> values;
  for (int single = 0; single < 2; ++single) {
    const uint32_t blocks = single == 1 ? 1 : c.blocks;
    auto map = Build(c, blocks, c.seed % 3 == 0 ? Routing::kBroadcast : Routing::kDirect);
    ASSERT_TRUE(map.ok()) << map.status();
    ASSERT_TRUE(Update(**map, definitions).ok());
    WriteAll(**map, 1);
    ASSERT_TRUE(Refine(**map, {c.refined.begin(), half}).ok());
    ASSERT_TRUE(Update(**map, definitions).ok());
    WriteAll(**map, c.seed % 2);
    ASSERT_TRUE(Refine(**map, {half, c.refined.end()}).ok());
    if (!c.removed.empty()) {
      const std::string removed = absl::StrJoin(
          c.removed, " ", [](std::string* out, const CellId& id) { absl::StrAppend(out, id.ToString()); });
      ASSERT_TRUE((*map)->Run("trim", Parameters().Set("cells", removed)).ok());
    }
    auto report = Update(**map, definitions);
    ASSERT_TRUE(report.ok()) << report.status();
    Collect(**map, values[single]);
    const auto cells = CellsOf(**map, GridCells(c.grid));
    for (unsigned i = 0; i < 4; ++i) {
      EXPECT_EQ(report->counts[absl::StrCat("values_", i)], static_cast<int64_t>(cells[i].size()));
      std::set<CellId> rows;
      for (const auto& [id, words] : values[single][i]) rows.insert(id);
      EXPECT_EQ(rows, cells[i]) << "dimension " << i;
    }
  }
  EXPECT_EQ(values[0], values[1]);
}

// What rules give, told by the geometry: the mean of points is where the map puts the new vertex, and volumes
// are divided when the corners say so.
TEST_P(AttributesTest, RulesAgreeWithTheGeometry) {
  RandomCase c = MakeRandomCase(GetParam());
  SCOPED_TRACE(c.Describe());
  const std::vector<AttributeDefinition> definitions = {
      Definition("place", 0, ValueType::kVec3, SplitRule::kMean),
      Definition("part", 3, ValueType::kDouble, SplitRule::kDivide),
      Definition("from", 3, ValueType::kInt64, SplitRule::kCopy)};
  auto map = Build(c, c.blocks, Routing::kDirect);
  ASSERT_TRUE(map.ok()) << map.status();
  ASSERT_TRUE(Update(**map, definitions).ok());
  std::map<uint64_t, double> volume;
  for (size_t b = 0; b < (*map)->blocks().size(); ++b) {
    auto& lcc = (*map)->blocks()[b]->map();
    AttributeTable& vertices = (*map)->attributes(b).table(0);
    for (uint32_t row = 0; row < vertices.size(); ++row) {
      const Point3 p = Frame<Block3>::StartPoint(lcc, DartAt(lcc, vertices.dart(row)));
      vertices.columns()[0]->Set(row, {Word(p[0]), Word(p[1]), Word(p[2])});
    }
    AttributeTable& hexahedra = (*map)->attributes(b).table(3);
    for (uint32_t row = 0; row < hexahedra.size(); ++row) {
      const auto cell = lcc.attribute<3>(DartAt(lcc, hexahedra.dart(row)));
      volume[hexahedra.id(row).initial()] = HexahedronVolume(Frame<Block3>::Of(lcc, cell).Corners(lcc));
      hexahedra.columns()[0]->Set(row, {Word(1), 0, 0});
      hexahedra.columns()[1]->Set(row, {hexahedra.id(row).initial(), 0, 0});
    }
  }
  ASSERT_TRUE(Refine(**map, c.refined).ok());
  ASSERT_TRUE(Update(**map, definitions).ok());
  std::map<uint64_t, double> parts, volumes, sizes;
  for (size_t b = 0; b < (*map)->blocks().size(); ++b) {
    auto& lcc = (*map)->blocks()[b]->map();
    const AttributeTable& vertices = (*map)->attributes(b).table(0);
    for (uint32_t row = 0; row < vertices.size(); ++row) {
      const Point3 p = Frame<Block3>::StartPoint(lcc, DartAt(lcc, vertices.dart(row)));
      const ValueWords mean = vertices.columns()[0]->Get(row);
      for (int k = 0; k < 3; ++k) {
        EXPECT_NEAR(Real(mean[k]), p[k], 1e-12 * (1 + std::abs(p[k]))) << vertices.id(row).ToString();
      }
    }
    const AttributeTable& hexahedra = (*map)->attributes(b).table(3);
    for (uint32_t row = 0; row < hexahedra.size(); ++row) {
      const uint64_t initial = hexahedra.id(row).initial();
      EXPECT_EQ(hexahedra.columns()[1]->Get(row)[0], initial);
      parts[initial] += Real(hexahedra.columns()[0]->Get(row)[0]);
      const auto cell = lcc.attribute<3>(DartAt(lcc, hexahedra.dart(row)));
      const double own = HexahedronVolume(Frame<Block3>::Of(lcc, cell).Corners(lcc));
      volumes[initial] += own;
      sizes[initial] += std::abs(own);
    }
  }
  for (const auto& [initial, sum] : parts) EXPECT_EQ(sum, 1.0) << initial;
  for (const auto& [initial, sum] : volumes) EXPECT_NEAR(sum, volume[initial], 1e-9 * sizes[initial]);
}

INSTANTIATE_TEST_SUITE_P(Seeds, AttributesTest, testing::Range<uint64_t>(1, 41));

CellId Id(const std::string& text) { return CellId::Parse(text).value(); }

// Two hexahedra side by side, the first one split: its faces and edges.
TEST(AttributesOfParts, HalvesAndQuartersHaveTheValueOfTheWhole) {
  Map map(1, Routing::kDirect, SimulatorOptions());
  const auto corner = [](uint32_t i, uint32_t j, uint32_t k) { return Point3{1.0 * i, 1.0 * j, 1.0 * k}; };
  ASSERT_TRUE(map.BuildGrid({2, 1, 1}, corner, {0, 0}).ok());
  const std::vector<AttributeDefinition> definitions = {
      Definition("face", 2, ValueType::kDouble, SplitRule::kCopy),
      Definition("flux", 2, ValueType::kDouble, SplitRule::kDivide),
      Definition("edge", 1, ValueType::kCategory, SplitRule::kCopy),
      Definition("mark", 1, ValueType::kInt64, SplitRule::kZero)};
  ASSERT_TRUE(Update(map, definitions).ok());
  AttributeTable& faces = map.attributes(0).table(2);
  AttributeTable& edges = map.attributes(0).table(1);
  // The face between the two, and the edge x = 1, y = 0 along z.
  const uint32_t between = faces.Find(Id("f0:5"));
  ASSERT_NE(between, AttributeTable::kNoRow);
  faces.columns()[0]->Set(between, {Word(20), 0, 0});
  faces.columns()[1]->Set(between, {Word(20), 0, 0});
  const uint32_t edge = edges.Find(Id("e0:9"));
  ASSERT_NE(edge, AttributeTable::kNoRow);
  edges.columns()[0]->Set(edge, {edges.columns()[0]->Code("ridge").value(), 0, 0});
  edges.columns()[1]->Set(edge, {11, 0, 0});
  ASSERT_TRUE(Refine(map, {Id("h0")}).ok());
  ASSERT_TRUE(Update(map, definitions).ok());
  EXPECT_EQ(faces.Find(Id("f0:5")), AttributeTable::kNoRow);
  for (const char* quarter : {"f0/1:5", "f0/3:5", "f0/5:5", "f0/7:5"}) {
    const uint32_t row = faces.Find(Id(quarter));
    ASSERT_NE(row, AttributeTable::kNoRow) << quarter;
    EXPECT_EQ(Real(faces.columns()[0]->Get(row)[0]), 20) << quarter;
    EXPECT_EQ(Real(faces.columns()[1]->Get(row)[0]), 5) << quarter;
  }
  // In the inside: made of no face.
  const uint32_t inner = faces.Find(Id("f0/0:5"));
  ASSERT_NE(inner, AttributeTable::kNoRow);
  EXPECT_EQ(Real(faces.columns()[0]->Get(inner)[0]), 0.5);
  EXPECT_EQ(edges.Find(Id("e0:9")), AttributeTable::kNoRow);
  for (const char* half : {"e0/1:9", "e0/5:9"}) {
    const uint32_t row = edges.Find(Id(half));
    ASSERT_NE(row, AttributeTable::kNoRow) << half;
    EXPECT_EQ(edges.columns()[0]->Text(edges.columns()[0]->Get(row)[0]), "ridge") << half;
    EXPECT_EQ(edges.columns()[1]->Get(row)[0], 0u) << half;
  }
}

TEST(AttributesOfParts, IntegersAreRoundedToEven) {
  Map map(1, Routing::kDirect, SimulatorOptions());
  const auto corner = [](uint32_t i, uint32_t j, uint32_t k) { return Point3{1.0 * i, 1.0 * j, 1.0 * k}; };
  ASSERT_TRUE(map.BuildGrid({1, 1, 1}, corner, {0}).ok());
  const std::vector<AttributeDefinition> definitions = {
      Definition("n", 0, ValueType::kInt64, SplitRule::kMean),
      Definition("m", 0, ValueType::kInt64, SplitRule::kMidpoint)};
  ASSERT_TRUE(Update(map, definitions).ok());
  AttributeTable& vertices = map.attributes(0).table(0);
  const auto most = std::numeric_limits<int64_t>::max();
  const std::array<int64_t, 8> at = {1, 2, -1, 4, most, most, -3, -3};
  for (unsigned v = 0; v < 8; ++v) {
    const uint32_t row = vertices.Find(Id(absl::StrCat("v0:", v)));
    ASSERT_NE(row, AttributeTable::kNoRow);
    for (auto& column : vertices.columns()) column->Set(row, {static_cast<uint64_t>(at[v]), 0, 0});
  }
  ASSERT_TRUE(Refine(map, {Id("h0")}).ok());
  ASSERT_TRUE(Update(map, definitions).ok());
  const auto value = [&](const std::string& id, int column) {
    const uint32_t row = vertices.Find(Id(id));
    EXPECT_NE(row, AttributeTable::kNoRow) << id;
    return static_cast<int64_t>(vertices.columns()[static_cast<size_t>(column)]->Get(row)[0]);
  };
  EXPECT_EQ(value("v0/0:1", 0), 2);     // 1.5
  EXPECT_EQ(value("v0/0:2", 0), 0);     // (1 - 1) / 2
  EXPECT_EQ(value("v0/0:3", 0), 2);     // (1 + 2 - 1 + 4) / 4 = 1.5
  EXPECT_EQ(value("v0/0:3", 1), 2);     // (1 + 4) / 2 = 2.5
  EXPECT_EQ(value("v0/4:5", 0), most);  // no overflow
}

TEST(AttributesOfParts, ColumnsComeAndGo) {
  Map map(2, Routing::kDirect, SimulatorOptions());
  const auto corner = [](uint32_t i, uint32_t j, uint32_t k) { return Point3{1.0 * i, 1.0 * j, 1.0 * k}; };
  ASSERT_TRUE(map.BuildGrid({2, 1, 1}, corner, {0, 1}).ok());
  const AttributeDefinition one = Definition("one", 0, ValueType::kDouble, SplitRule::kMean);
  const AttributeDefinition two = Definition("two", 0, ValueType::kInt64, SplitRule::kCopy);
  ASSERT_TRUE(Update(map, {one}).ok());
  AttributeTable& table = map.attributes(0).table(0);
  table.Find("one")->Set(table.Find(Id("v0:0")), {Word(3), 0, 0});
  ASSERT_TRUE(Update(map, {one, two}).ok());
  EXPECT_EQ(Real(table.Find("one")->Get(table.Find(Id("v0:0")))[0]), 3);
  EXPECT_EQ(table.Find("two")->Get(table.Find(Id("v0:0")))[0], 7u);
  // The same name again is another attribute.
  AttributeDefinition again = one;
  again.number = two.number + 1;
  ASSERT_TRUE(Update(map, {again}).ok());
  EXPECT_EQ(table.Find("two"), nullptr);
  EXPECT_EQ(Real(table.Find("one")->Get(table.Find(Id("v0:0")))[0]), 0.5);
  ASSERT_TRUE(Update(map, {}).ok());
  EXPECT_EQ(table.size(), 0u);
}

}  // namespace
}  // namespace ndmap
