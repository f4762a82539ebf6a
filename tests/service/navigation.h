// SPDX-License-Identifier: GPL-3.0-or-later
// Navigation through real services against one CGAL map of the same mesh: the map, what its darts are called,
// and the questions, for tests that make maps of one kind or another.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "core/geometry/compare_distance.h"
#include "core/names/cell_names.h"
#include "core/navigate/cell_shape.h"
#include "tests/property/property_case.h"
#include "tests/service/cluster.h"

namespace ndmap {

using Ids = std::set<CellId>;
// What a dart is called in every cut of the map: the ids of its vertex, edge, face and 3-cell.
using Name = std::array<CellId, 4>;
using Phases = std::vector<std::pair<std::string, Cluster::Values>>;

inline int FromEnvironment(const char* name, int otherwise) {
  const char* text = std::getenv(name);
  return text == nullptr ? otherwise : std::atoi(text);
}

// A map in one block, and what its darts are called.
class Whole {
 public:
  using Lcc = Block3::Lcc;

  // Nothing is in it yet.
  Whole() : map_(1, Routing::kDirect, {}) {}
  SimulatedMap<Block3>& map() { return map_; }

  void Run(const Phases& phases) {
    for (const auto& [algorithm, values] : phases) {
      auto report = map_.Run(algorithm, Parameters({values.begin(), values.end()}));
      EXPECT_TRUE(report.ok()) << report.status();
    }
  }
  // When it is as it stays.
  void NameDarts(std::shared_ptr<const InitialCells> initial) {
    EXPECT_TRUE(lcc().is_valid());
    initial_ = std::move(initial);
    CellNames<Block3> names(lcc(), *initial_);
    auto& cells = lcc().attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      boxes_[lcc().info_of_attribute<3>(it).id] = CellBox<Block3>(lcc(), it);
      const size_t darts = names.Look(it);
      for (size_t k = 0; k < darts; ++k) {
        const Name name = {names.Name(k, 0), names.Name(k, 1), names.Name(k, 2), names.Name(k, 3)};
        const DartIndex dart = IndexOf(lcc(), names.dart(k));
        names_[dart] = name;
        darts_[name] = dart;
        for (unsigned i = 0; i < 4; ++i) cells_[i][name[i]].push_back(dart);
      }
    }
    EXPECT_EQ(names_.size(), lcc().number_of_darts());
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
  // Whether the 3-cell meets the closed box, exactly.
  bool Meets(const CellId& cell, const Box3& box) {
    CellNames<Block3> names(lcc(), *initial_);
    return CellMeets(*map_.blocks()[0], names, lcc().attribute<3>(DartAt(lcc(), DartsOf(3, cell).front())),
                     box);
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
  std::shared_ptr<const InitialCells> initial_;
  std::map<DartIndex, Name> names_;
  std::map<Name, DartIndex> darts_;
  std::map<CellId, Box3> boxes_;
  std::array<std::map<CellId, std::vector<DartIndex>>, 4> cells_;
  std::array<std::vector<CellId>, 4> all_;
};

inline bool Meet(const Box3& a, const Box3& b) {
  for (int c = 0; c < 3; ++c) {
    if (a.lo[c] > b.hi[c] || b.lo[c] > a.hi[c]) return false;
  }
  return true;
}
inline void Set(const Point3& p, v1::Point* point) {
  point->set_x(p[0]);
  point->set_y(p[1]);
  point->set_z(p[2]);
}

// Questions to a map of a cluster of three servers.
class Navigation {
 public:
  Navigation(Cluster& cluster, std::string map, uint32_t blocks, Whole& whole)
      : cluster_(cluster), map_(std::move(map)), blocks_(blocks), whole_(whole), random_(blocks) {}

  v1::ExploreResponse Ask(v1::ExploreRequest request) {
    request.set_map(map_);
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    // Any server may be asked.
    auto stub = cluster_.ServerOf(map_, static_cast<uint32_t>(random_() % blocks_));
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

  void HasTheSameCells() {
    for (unsigned i = 0; i < 4; ++i) {
      v1::ExploreRequest request;
      for (uint32_t b = 0; b < blocks_; ++b) request.add_anchors()->set_block(b);
      request.set_give(v1::GIVE_CELLS);
      request.set_dimension(i);
      EXPECT_EQ(AskIds(request), Ids(whole_.All(i).begin(), whole_.All(i).end())) << "dimension " << i;
    }
  }

  void OrbitsIncidentAndAdjacentCellsAndRings(int questions) {
    for (int k = 0; k < questions; ++k) {
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

  void WordsOfBetas(int questions) {
    for (int k = 0; k < questions; ++k) {
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
      walk.set_map(map_);
      walk.set_block(from.block());
      *walk.add_starts()->mutable_dart() = from;
      walk.set_word(word);
      v1::BetaResponse response;
      grpc::ClientContext context;
      const grpc::Status status = cluster_.ServerOf(map_, from.block())->Beta(&context, walk, &response);
      ASSERT_TRUE(status.ok()) << status.error_message();
      const auto [end, used] = whole_.Walk(whole_.DartOf(name), word);
      EXPECT_EQ(response.results(0).used(), used);
      EXPECT_EQ(NameOfDart(response.results(0).at().dart()), whole_.NameOfDart(end));
    }
  }

  // The 3-cells that contain a point, or meet a box.
  Ids Located(const Point3& p) {
    v1::ExploreRequest locate;
    Set(p, locate.add_anchors()->mutable_point());
    locate.set_give(v1::GIVE_CELLS);
    locate.set_dimension(3);
    return AskIds(locate);
  }
  Ids Within(const Box3& box) {
    v1::ExploreRequest within;
    Set(box.lo, within.add_anchors()->mutable_box()->mutable_lo());
    Set(box.hi, within.mutable_anchors(0)->mutable_box()->mutable_hi());
    within.set_give(v1::GIVE_CELLS);
    within.set_dimension(3);
    return AskIds(within);
  }
  void NearestVertex(const Point3& p) {
    std::optional<std::pair<Point3, CellId>> nearest;
    for (const CellId& id : whole_.All(0)) {
      const Point3 q = whole_.PointOf(id);
      const int order = nearest ? CompareDistance(p, q, nearest->first) : -1;
      if (order < 0 || (order == 0 && id < nearest->second)) nearest = {q, id};
    }
    v1::ExploreRequest near;
    Set(p, near.add_anchors()->mutable_nearest_vertex());
    near.set_give(v1::GIVE_CELLS);
    near.set_dimension(0);
    EXPECT_EQ(AskIds(near), Ids{nearest->second});
  }
  Point3 RandomPoint(const Box3& in) {
    Point3 p;
    for (int c = 0; c < 3; ++c)
      p[c] = in.lo[c] + (in.hi[c] - in.lo[c]) * static_cast<double>(random_() >> 11) * 0x1p-53;
    return p;
  }
  Box3 RandomBox(const Box3& in) {
    const Point3 a = RandomPoint(in), b = RandomPoint(in);
    Box3 box;
    for (int c = 0; c < 3; ++c) {
      const double middle = (a[c] + b[c]) / 2, half = std::abs(a[c] - b[c]) / 8;
      box.lo[c] = middle - half;
      box.hi[c] = middle + half;
    }
    return box;
  }
  CellId AnyCell(unsigned i) { return whole_.All(i)[random_() % whole_.All(i).size()]; }

 private:
  Cluster& cluster_;
  const std::string map_;
  const uint32_t blocks_;
  Whole& whole_;
  std::mt19937_64 random_;
};

}  // namespace ndmap
