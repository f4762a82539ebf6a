// SPDX-License-Identifier: GPL-3.0-or-later
// Navigation through real services on refined and trimmed meshes of surfaces, with 1, 2 and 8 blocks, against
// one CGAL map of the same mesh. The surface: a sample torus, elephant where the folder of meshes is there,
// or the file that the variable NDMAP_NAVIGATE_SURFACE names (tests/service/navigate_surfaces.sh).
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <map>
#include <random>
#include <set>
#include <tuple>

#include "core/io/surface_reader.h"
#include "core/names/hexahedron_lattice.h"
#include "tests/property/property_case.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using Ids = std::set<CellId>;
// What a dart is called in every cut of the map: the ids of its vertex, edge, face and hexahedron.
using Name = std::array<CellId, 4>;
using Lcc = Block3::Lcc;

int FromEnvironment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}
const int kDepth = FromEnvironment("NDMAP_NAVIGATE_DEPTH", 2);
const int kQuestions = FromEnvironment("NDMAP_NAVIGATE_QUESTIONS", 60);

TriangleSurface Surface() {
  if (const char* file = std::getenv("NDMAP_NAVIGATE_SURFACE"); file != nullptr)
    return ReadSurface(file, {.check_self_intersections = false}).value().surface;
#ifdef NDMAP_MESHES
  return ReadSurface(std::string(NDMAP_MESHES) + "/surfaces/elephant.off").value().surface;
#else
  return MakeSample("torus", {2000, 1}).value();
#endif
}

// Refine, classify, trim.
std::vector<std::pair<std::string, Cluster::Values>> MainJob() {
  std::vector<std::pair<std::string, Cluster::Values>> phases;
  for (int level = 0; level < kDepth; ++level) {
    phases.push_back({"refine", {{"depth", absl::StrCat(kDepth)}, {"level", absl::StrCat(level)}}});
  }
  phases.insert(phases.end(), {{"classify", {}}, {"trim", {}}});
  return phases;
}

// The mesh as one CGAL map, and what its darts are called.
class Whole {
 public:
  Whole(const TriangleSurface& surface, const GridShape& grid) : map_(1, Routing::kDirect, {}) {
    map_.set_surface(std::make_shared<const TriangleSurface>(surface));
    const auto corner = [&](uint32_t i, uint32_t j, uint32_t k) { return grid.Corner(i, j, k); };
    EXPECT_TRUE(map_.BuildGrid(grid.cells, corner, std::vector<uint32_t>(grid.CellCount(), 0)).ok());
    for (const auto& [algorithm, values] : MainJob()) {
      auto report = map_.Run(algorithm, Parameters({values.begin(), values.end()}));
      EXPECT_TRUE(report.ok()) << report.status();
    }
    EXPECT_TRUE(lcc().is_valid());
    const GridCells initial(grid.cells);
    HexahedronLattice<Block3> lattice(lcc());
    auto& cells = lcc().attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      const CellId id = lcc().info_of_attribute<3>(it).id;
      boxes_[id] = CornerBox(Frame<Block3>::Of(lcc(), it).Corners(lcc()));
      for (const auto& placed : lattice.Of(it)) {
        const Name name = {NameOf(initial, placed.vertex), NameOf(initial, placed.edge),
                           NameOf(initial, placed.face), id};
        names_[IndexOf(lcc(), placed.dart)] = name;
        darts_[name] = IndexOf(lcc(), placed.dart);
        for (unsigned i = 0; i < 4; ++i) cells_[i][name[i]].push_back(IndexOf(lcc(), placed.dart));
      }
    }
    for (unsigned i = 0; i < 4; ++i) {
      for (const auto& [id, darts] : cells_[i]) all_[i].push_back(id);
    }
  }

  Lcc& lcc() { return map_.blocks()[0]->map(); }
  const std::vector<CellId>& All(unsigned i) const { return all_[i]; }
  const std::map<CellId, Box3>& boxes() const { return boxes_; }
  const Name& NameOfDart(DartIndex d) const { return names_.at(d); }
  DartIndex DartOf(const Name& name) const { return darts_.at(name); }
  const std::vector<DartIndex>& DartsOf(unsigned i, const CellId& id) const { return cells_[i].at(id); }

  // The union of CGAL's orbits of these cells, closure after closure.
  std::set<DartIndex> Close(const CellId& start, const std::vector<uint32_t>& closures, unsigned dimension) {
    std::set<DartIndex> darts = {DartsOf(dimension, start).front()};
    for (uint32_t i : closures) {
      std::set<DartIndex> closed;
      for (DartIndex d : darts) {
        if (!closed.contains(d)) AddOrbit(i, DartAt(lcc(), d), closed);
      }
      darts = closed;
    }
    return darts;
  }
  Ids CellsIn(const std::set<DartIndex>& darts, unsigned i) const {
    Ids ids;
    for (DartIndex d : darts) ids.insert(names_.at(d)[i]);
    return ids;
  }
  Point3 PointOf(const CellId& vertex) {
    return Frame<Block3>::StartPoint(lcc(), DartAt(lcc(), DartsOf(0, vertex).front()));
  }
  // Where a walk ends: the dart, and how many letters were possible.
  std::pair<DartIndex, size_t> Walk(DartIndex from, const std::string& word) {
    auto d = DartAt(lcc(), from);
    for (size_t k = 0; k < word.size(); ++k) {
      const int i = word[k];
      if (i != 0 && lcc().is_free(d, static_cast<unsigned>(i))) return {IndexOf(lcc(), d), k};
      d = lcc().beta(d, i);
    }
    return {IndexOf(lcc(), d), word.size()};
  }

 private:
  template <unsigned i>
  void AddCell(Lcc::Dart_handle d, std::set<DartIndex>& into) {
    for (auto it = lcc().darts_of_cell<i>(d).begin(); it.cont(); ++it) into.insert(IndexOf(lcc(), it));
  }
  void AddOrbit(uint32_t i, Lcc::Dart_handle d, std::set<DartIndex>& into) {
    if (i == 0) AddCell<0>(d, into);
    if (i == 1) AddCell<1>(d, into);
    if (i == 2) AddCell<2>(d, into);
    if (i == 3) AddCell<3>(d, into);
  }

  SimulatedMap<Block3> map_;
  std::map<DartIndex, Name> names_;
  std::map<Name, DartIndex> darts_;
  std::map<CellId, Box3> boxes_;
  std::array<std::map<CellId, std::vector<DartIndex>>, 4> cells_;
  std::array<std::vector<CellId>, 4> all_;
};

bool Meet(const Box3& a, const Box3& b) {
  for (int c = 0; c < 3; ++c) {
    if (a.lo[c] > b.hi[c] || b.lo[c] > a.hi[c]) return false;
  }
  return true;
}
void Set(const Point3& p, v1::Point* point) {
  point->set_x(p[0]);
  point->set_y(p[1]);
  point->set_z(p[2]);
}

class NavigateSurfaces : public ::testing::TestWithParam<uint32_t> {
 protected:
  struct Reference {
    TriangleSurface surface;
    GridShape grid;
    std::unique_ptr<Whole> whole;
  };
  static Reference& Shared() {
    static auto& reference = *[] {
      auto* made = new Reference{Surface(), {}, nullptr};
      made->grid = GridFromCubes(BoundingBox(made->surface), 6).value();
      made->whole = std::make_unique<Whole>(made->surface, made->grid);
      return made;
    }();
    return reference;
  }

  NavigateSurfaces() : cluster_(3), whole_(*Shared().whole), random_(GetParam()) {
    const Reference& reference = Shared();
    const std::string id = service::SurfaceId(reference.surface);
    EXPECT_TRUE(cluster_.Upload(reference.surface, id).ok());
    v1::CreateMapRequest request;
    request.set_map("mesh");
    request.set_surface_id(id);
    request.set_block_count(GetParam());
    request.set_depth(static_cast<uint32_t>(kDepth));
    for (int c = 0; c < 3; ++c) {
      request.mutable_grid()->add_cells(reference.grid.cells[c]);
      request.mutable_grid()->add_lo(reference.grid.lo[c]);
      request.mutable_grid()->add_hi(reference.grid.hi[c]);
    }
    EXPECT_EQ(cluster_.Create(request).state(), v1::JOB_STATE_DONE);
    const v1::Job job = cluster_.Run("mesh", MainJob());
    EXPECT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  }

  v1::ExploreResponse Ask(v1::ExploreRequest request) {
    request.set_map("mesh");
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    // Any server may be asked.
    auto stub = cluster_.ServerOf("mesh", static_cast<uint32_t>(random_() % GetParam()));
    auto reader = stub->Explore(&context, request);
    v1::ExploreResponse all, part;
    while (reader->Read(&part)) all.MergeFrom(part);
    const grpc::Status status = reader->Finish();
    EXPECT_TRUE(status.ok()) << status.error_message() << "\n" << request.ShortDebugString();
    return all;
  }
  Ids AskIds(const v1::ExploreRequest& request) {
    const v1::ExploreResponse all = Ask(request);
    Ids ids;
    for (int k = 0; k < all.cell_hi_size(); ++k) {
      EXPECT_TRUE(ids.insert(CellId::FromWords(all.cell_hi(k), all.cell_lo(k))).second);
    }
    return ids;
  }
  static v1::ExploreRequest About(const CellId& cell, const std::vector<uint32_t>& close, unsigned give) {
    v1::ExploreRequest request;
    request.add_anchors()->mutable_cell()->set_hi(cell.hi());
    request.mutable_anchors(0)->mutable_cell()->set_lo(cell.lo());
    request.mutable_close()->Add(close.begin(), close.end());
    request.set_give(v1::GIVE_CELLS);
    request.set_dimension(give);
    return request;
  }
  Name NameOfDart(const v1::DartRef& dart) {
    Name name;
    for (unsigned i = 0; i < 4; ++i) {
      v1::ExploreRequest request;
      *request.add_anchors()->mutable_dart() = dart;
      request.set_give(v1::GIVE_CELLS);
      request.set_dimension(i);
      const Ids ids = AskIds(request);
      EXPECT_EQ(ids.size(), 1u);
      if (!ids.empty()) name[i] = *ids.begin();
    }
    return name;
  }
  CellId AnyCell(unsigned i) { return whole_.All(i)[random_() % whole_.All(i).size()]; }

  Cluster cluster_;
  Whole& whole_;
  std::mt19937_64 random_;
};

TEST_P(NavigateSurfaces, HasTheSameCells) {
  for (unsigned i = 0; i < 4; ++i) {
    v1::ExploreRequest request;
    for (uint32_t b = 0; b < GetParam(); ++b) request.add_anchors()->set_block(b);
    request.set_give(v1::GIVE_CELLS);
    request.set_dimension(i);
    EXPECT_EQ(AskIds(request), Ids(whole_.All(i).begin(), whole_.All(i).end())) << "dimension " << i;
  }
}

TEST_P(NavigateSurfaces, OrbitsIncidentAndAdjacentCellsAndRings) {
  for (int k = 0; k < kQuestions; ++k) {
    const unsigned i = static_cast<unsigned>(random_() % 4), j = static_cast<unsigned>(random_() % 4);
    // One id may name two orbits, where parts of the mesh touch only at a vertex or along an edge: then
    // either may be meant.
    CellId cell = AnyCell(i);
    while (whole_.Close(cell, {i}, i).size() != whole_.DartsOf(i, cell).size()) cell = AnyCell(i);
    SCOPED_TRACE(cell.ToString());
    // The whole orbit, by name, which is incident cells, too.
    v1::ExploreRequest orbit = About(cell, {i}, 0);
    orbit.set_give(v1::GIVE_DARTS);
    EXPECT_EQ(static_cast<size_t>(Ask(orbit).darts_size()), whole_.DartsOf(i, cell).size());
    EXPECT_EQ(AskIds(About(cell, {i}, j)), whole_.CellsIn(whole_.Close(cell, {i}, i), j));
    // Adjacent across cells of dimension j.
    v1::ExploreRequest adjacent = About(cell, {i, j}, i);
    adjacent.set_without_anchors(true);
    Ids expected = whole_.CellsIn(whole_.Close(cell, {i, j}, i), i);
    expected.erase(cell);
    EXPECT_EQ(AskIds(adjacent), expected);
    // Rings: closures over and over.
    const std::vector<uint32_t> ring =
        i == 3 ? std::vector<uint32_t>{3, 0, 3, 0, 3} : std::vector<uint32_t>{i, 3, i, 3};
    EXPECT_EQ(AskIds(About(cell, ring, 3)), whole_.CellsIn(whole_.Close(cell, ring, i), 3));
  }
}

TEST_P(NavigateSurfaces, WordsOfBetas) {
  for (int k = 0; k < kQuestions; ++k) {
    const CellId cell = AnyCell(3);
    v1::ExploreRequest request = About(cell, {3}, 3);
    request.set_give(v1::GIVE_CELL_DETAILS);
    const v1::ExploreResponse details = Ask(request);
    ASSERT_EQ(details.cells_size(), 1);
    const v1::DartRef from = details.cells(0).dart();
    const Name name = NameOfDart(from);
    // The canonical dart of a hexahedron: the lowest face, of it the lowest edge.
    std::tuple<CellId, CellId> lowest = {name[2], name[1]};
    for (DartIndex d : whole_.DartsOf(3, cell)) {
      const Name& other = whole_.NameOfDart(d);
      lowest = std::min(lowest, {other[2], other[1]});
    }
    EXPECT_EQ(lowest, std::tuple(name[2], name[1])) << cell.ToString();
    std::string word;
    for (uint64_t n = random_() % 40; word.size() < n;) word.push_back(static_cast<char>(random_() % 4));
    v1::BetaRequest walk;
    walk.set_map("mesh");
    walk.set_block(from.block());
    *walk.add_starts()->mutable_dart() = from;
    walk.set_word(word);
    v1::BetaResponse response;
    grpc::ClientContext context;
    const grpc::Status status = cluster_.ServerOf("mesh", from.block())->Beta(&context, walk, &response);
    ASSERT_TRUE(status.ok()) << status.error_message();
    const auto [end, used] = whole_.Walk(whole_.DartOf(name), word);
    EXPECT_EQ(response.results(0).used(), used);
    EXPECT_EQ(NameOfDart(response.results(0).at().dart()), whole_.NameOfDart(end));
  }
}

TEST_P(NavigateSurfaces, PointsBoxesAndNearestVertices) {
  const GridShape& grid = Shared().grid;
  const auto random_point = [&] {
    Point3 p;
    for (int c = 0; c < 3; ++c)
      p[c] = grid.lo[c] + (grid.hi[c] - grid.lo[c]) * static_cast<double>(random_() >> 11) * 0x1p-53;
    return p;
  };
  const auto hexahedra_at = [&](const Box3& box) {
    Ids ids;
    for (const auto& [id, own] : whole_.boxes()) {
      if (Meet(box, own)) ids.insert(id);
    }
    return ids;
  };
  for (int k = 0; k < kQuestions; ++k) {
    // A vertex is on the boundary between cells.
    const Point3 p = k % 2 == 0 ? whole_.PointOf(AnyCell(0)) : random_point();
    v1::ExploreRequest locate;
    Set(p, locate.add_anchors()->mutable_point());
    locate.set_give(v1::GIVE_CELLS);
    locate.set_dimension(3);
    EXPECT_EQ(AskIds(locate), hexahedra_at({p, p}));
    const Point3 a = random_point(), b = random_point();
    Box3 box;
    for (int c = 0; c < 3; ++c) {
      const double middle = (a[c] + b[c]) / 2, half = std::abs(a[c] - b[c]) / 8;
      box.lo[c] = middle - half;
      box.hi[c] = middle + half;
    }
    v1::ExploreRequest within;
    Set(box.lo, within.add_anchors()->mutable_box()->mutable_lo());
    Set(box.hi, within.mutable_anchors(0)->mutable_box()->mutable_hi());
    within.set_give(v1::GIVE_CELLS);
    within.set_dimension(3);
    EXPECT_EQ(AskIds(within), hexahedra_at(box));
    std::pair<double, CellId> nearest = {std::numeric_limits<double>::infinity(), {}};
    for (const CellId& id : whole_.All(0)) {
      const Point3 q = whole_.PointOf(id);
      double squared = 0;
      for (int c = 0; c < 3; ++c) squared += (q[c] - a[c]) * (q[c] - a[c]);
      nearest = std::min(nearest, {squared, id});
    }
    v1::ExploreRequest near;
    Set(a, near.add_anchors()->mutable_nearest_vertex());
    near.set_give(v1::GIVE_CELLS);
    near.set_dimension(0);
    EXPECT_EQ(AskIds(near), Ids{nearest.second});
  }
}

INSTANTIATE_TEST_SUITE_P(Blocks, NavigateSurfaces, ::testing::Values(1, 2, 8));

}  // namespace
}  // namespace ndmap
