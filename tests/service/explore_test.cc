// SPDX-License-Identifier: GPL-3.0-or-later
// Questions about cells and neighbourhoods put to real services, against orbits of CGAL on the gathered map.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>
#include <map>
#include <random>
#include <set>

#include "core/names/hexahedron_lattice.h"
#include "core/navigate/closure.h"
#include "core/navigate/memory_access.h"
#include "tests/property/property_case.h"
#include "tests/service/cluster.h"

namespace ndmap {
namespace {

using ::testing::HasSubstr;
using Ids = std::set<CellId>;
using Darts = std::set<uint32_t>;

constexpr char kRefined[] = "h0 h0/7 h0/7.0 h5 h5/2 h6/1 h6 h6/1.3";

// The map in one piece, and the ids of its darts.
class Whole {
 public:
  Whole() : map_(1, Routing::kDirect, SimulatorOptions()) {
    const GridShape shape{{2, 2, 2}, {0, 0, 0}, {2, 2, 2}};
    auto corner = [&](uint32_t i, uint32_t j, uint32_t k) { return shape.Corner(i, j, k); };
    EXPECT_TRUE(map_.BuildGrid(shape.cells, corner, std::vector<uint32_t>(8, 0)).ok());
    EXPECT_TRUE(
        map_.Run("refine", Parameters().Set("oracle", "list").Set("cells", kRefined).Set("depth", int64_t{4}))
            .ok());
    HexahedronLattice<Block3> lattice(map());
    const GridCells initial({2, 2, 2});
    auto& cells = map().attributes<3>();
    for (auto it = cells.begin(); it != cells.end(); ++it) {
      for (const auto& placed : lattice.Of(it)) {
        ids_[IndexOf(map(), placed.dart).value] = {NameOf(initial, placed.vertex),
                                                   NameOf(initial, placed.edge), NameOf(initial, placed.face),
                                                   map().info_of_attribute<3>(it).id};
      }
    }
  }

  Block3::Lcc& map() { return map_.blocks()[0]->map(); }

  Darts Of(unsigned dimension, const CellId& id) const {
    Darts darts;
    for (const auto& [d, ids] : ids_) {
      if (ids[dimension] == id) darts.insert(d);
    }
    return darts;
  }
  Ids CellsIn(const Darts& darts, unsigned dimension) const {
    Ids ids;
    for (uint32_t d : darts) ids.insert(ids_.at(d)[dimension]);
    return ids;
  }
  Ids All(unsigned dimension) const {
    Ids ids;
    for (const auto& [d, names] : ids_) ids.insert(names[dimension]);
    return ids;
  }
  Darts Close(unsigned i, const Darts& start) {
    switch (i) {
      case 0:
        return CloseBy<0>(start);
      case 1:
        return CloseBy<1>(start);
      case 2:
        return CloseBy<2>(start);
      default:
        return CloseBy<3>(start);
    }
  }

 private:
  template <unsigned i>
  Darts CloseBy(const Darts& start) {
    Darts darts;
    for (uint32_t d : start) {
      if (darts.contains(d)) continue;
      const auto handle = DartAt(map(), DartIndex{d});
      for (auto it = map().darts_of_cell<i>(handle).begin(); it.cont(); ++it) {
        darts.insert(IndexOf(map(), it).value);
      }
    }
    return darts;
  }

  SimulatedMap<Block3> map_;
  std::map<uint32_t, std::array<CellId, 4>> ids_;
};

class ExploreTest : public ::testing::Test {
 protected:
  ExploreTest() : cluster_(3) {}

  void Make(const std::string& name, uint32_t blocks, v1::Routing routing = v1::ROUTING_DIRECT) {
    v1::CreateMapRequest request = Cluster::GridRequest(name, blocks);
    request.set_routing(routing);
    ASSERT_EQ(cluster_.Create(request).state(), v1::JOB_STATE_DONE);
    const v1::Job job =
        cluster_.Run(name, {{"refine", {{"oracle", "list"}, {"cells", kRefined}, {"depth", "4"}}}});
    ASSERT_EQ(job.state(), v1::JOB_STATE_DONE) << job.error();
  }

  v1::ExploreRequest Question(const std::string& map, const CellId& cell, std::vector<uint32_t> close,
                              unsigned dimension, v1::Give give = v1::GIVE_CELLS) {
    v1::ExploreRequest request;
    request.set_map(map);
    request.add_anchors()->mutable_cell()->set_hi(cell.hi());
    request.mutable_anchors(0)->mutable_cell()->set_lo(cell.lo());
    request.mutable_close()->Add(close.begin(), close.end());
    request.set_dimension(dimension);
    request.set_give(give);
    return request;
  }

  grpc::Status Ask(const v1::ExploreRequest& request, v1::ExploreResponse* all) {
    grpc::ClientContext context;
    context.set_deadline(std::chrono::system_clock::now() + std::chrono::seconds(60));
    all->Clear();
    auto stub = cluster_.ServerOf(request.map(), 0);
    auto reader = stub->Explore(&context, request);
    v1::ExploreResponse part;
    while (reader->Read(&part)) all->MergeFrom(part);
    return reader->Finish();
  }
  v1::ExploreResponse MustAsk(const v1::ExploreRequest& request) {
    v1::ExploreResponse all;
    const grpc::Status status = Ask(request, &all);
    EXPECT_TRUE(status.ok()) << status.error_message();
    return all;
  }
  // The ids, in the order in which they came, which must be ascending.
  Ids MustAskIds(const v1::ExploreRequest& request) {
    const v1::ExploreResponse answer = MustAsk(request);
    Ids ids;
    for (int i = 0; i < answer.cell_hi_size(); ++i) {
      const CellId id = CellId::FromWords(answer.cell_hi(i), answer.cell_lo(i));
      EXPECT_TRUE(ids.empty() || *ids.rbegin() < id);
      ids.insert(id);
    }
    return ids;
  }
  grpc::StatusCode CodeOf(const v1::ExploreRequest& request) {
    v1::ExploreResponse all;
    const grpc::Status status = Ask(request, &all);
    message_ = status.error_message();
    return status.error_code();
  }

  Cluster cluster_;
  Whole whole_;
  std::string message_;
};

TEST_F(ExploreTest, NeighbourhoodsAreThoseOfTheWholeMapForAnyNumberOfBlocks) {
  Make("one", 1);
  Make("two", 2);
  Make("eight", 8);
  Make("broadcast", 5, v1::ROUTING_BROADCAST);
  std::mt19937_64 random(7);
  for (unsigned i = 0; i <= 3; ++i) {
    const Ids all = whole_.All(i);
    for (int k = 0; k < 12; ++k) {
      auto it = all.begin();
      std::advance(it, static_cast<int64_t>(random() % all.size()));
      const unsigned j = static_cast<unsigned>(random() % 4), give = static_cast<unsigned>(random() % 4);
      const Darts own = whole_.Of(i, *it);
      const Darts around = whole_.Close(i, whole_.Close(j, own));
      for (const char* map : {"one", "two", "eight", "broadcast"}) {
        SCOPED_TRACE(absl::StrCat(map, " ", it->ToString(), " over ", j, " give ", give));
        EXPECT_EQ(MustAskIds(Question(map, *it, {i}, give)), whole_.CellsIn(own, give));
        EXPECT_EQ(MustAskIds(Question(map, *it, {i, j, i}, give)), whole_.CellsIn(around, give));
        v1::ExploreRequest others = Question(map, *it, {i, j}, i);
        others.set_without_anchors(true);
        Ids expected = whole_.CellsIn(whole_.Close(j, own), i);
        expected.erase(*it);
        EXPECT_EQ(MustAskIds(others), expected);
        EXPECT_EQ(static_cast<size_t>(MustAsk(Question(map, *it, {i}, 0, v1::GIVE_DARTS)).darts_size()),
                  own.size());
      }
    }
  }
}

TEST_F(ExploreTest, DetailsTellTheWholeCell) {
  Make("m", 8);
  for (unsigned i = 0; i <= 3; ++i) {
    v1::ExploreRequest request = Question("m", CellId::Initial(0), {}, i, v1::GIVE_CELL_DETAILS);
    request.clear_anchors();
    for (uint32_t b = 0; b < 8; ++b) request.add_anchors()->set_block(b);
    const v1::ExploreResponse answer = MustAsk(request);
    Ids ids;
    for (const v1::CellDetails& cell : answer.cells()) {
      const CellId id = CellId::FromWords(cell.id().hi(), cell.id().lo());
      ids.insert(id);
      SCOPED_TRACE(cell.text());
      const Darts darts = whole_.Of(i, id);
      EXPECT_EQ(cell.text(), id.ToString());
      EXPECT_EQ(cell.dimension(), i);
      EXPECT_EQ(cell.darts(), darts.size());
      EXPECT_EQ(cell.vertices_size(), cell.points_size());
      Ids vertices;
      for (const v1::CellId& v : cell.vertices()) vertices.insert(CellId::FromWords(v.hi(), v.lo()));
      const Ids expected = whole_.CellsIn(darts, 0);
      if (i == 3) {
        EXPECT_EQ(vertices.size(), 8u);
        EXPECT_TRUE(std::includes(expected.begin(), expected.end(), vertices.begin(), vertices.end()));
      } else {
        EXPECT_EQ(vertices, expected);
      }
      bool boundary = false;
      for (uint32_t d : darts)
        boundary = boundary || whole_.map().is_free<3>(DartAt(whole_.map(), DartIndex{d}));
      EXPECT_EQ(cell.boundary(), boundary);
    }
    EXPECT_EQ(ids, whole_.All(i));
  }
}

TEST_F(ExploreTest, PlacesAreFound) {
  Make("one", 1);
  Make("eight", 8);
  for (const char* map : {"one", "eight"}) {
    v1::ExploreRequest request = Question(map, CellId::Initial(0), {}, 3);
    auto at = [&](double x, double y, double z) {
      request.clear_anchors();
      v1::Point& p = *request.add_anchors()->mutable_point();
      p.set_x(x);
      p.set_y(y);
      p.set_z(z);
      return MustAskIds(request);
    };
    EXPECT_EQ(at(1.75, 0.25, 0.25), Ids{CellId::Initial(1)});
    // The middle of the grid: one hexahedron of each initial one.
    const Ids middle = at(1, 1, 1);
    EXPECT_EQ(middle, whole_.CellsIn(whole_.Of(0, CellId::Parse("v0:7").value()), 3));
    EXPECT_EQ(middle.size(), 8u);
    EXPECT_TRUE(at(2.5, 1, 1).empty());

    request.clear_anchors();
    v1::Box& box = *request.add_anchors()->mutable_box();
    box.mutable_lo()->set_x(-1);
    box.mutable_lo()->set_y(-1);
    box.mutable_lo()->set_z(-1);
    for (auto set : {&v1::Point::set_x, &v1::Point::set_y, &v1::Point::set_z}) (box.mutable_hi()->*set)(5);
    EXPECT_EQ(MustAskIds(request), whole_.All(3));

    v1::ExploreRequest nearest = Question(map, CellId::Initial(0), {0}, 0);
    nearest.clear_anchors();
    v1::Point& p = *nearest.add_anchors()->mutable_nearest_vertex();
    p.set_x(0.76);
    p.set_y(0.74);
    p.set_z(0.7);
    const v1::ExploreRequest details = [&] {
      v1::ExploreRequest d = nearest;
      d.set_give(v1::GIVE_CELL_DETAILS);
      return d;
    }();
    ASSERT_EQ(MustAsk(details).cells_size(), 1);
    const v1::Point found = MustAsk(details).cells(0).points(0);
    EXPECT_EQ(found.x(), 0.75);
    EXPECT_EQ(found.y(), 0.75);
    EXPECT_EQ(found.z(), 0.75);

    // Wherever the point is: squared distances overflow, vanish, or are all the same number.
    const std::vector<std::pair<Point3, Point3>> far = {{{1e200, 0, 0}, {2, 0, 0}},
                                                        {{-1e200, 2, 2}, {0, 2, 2}},
                                                        {{1e17, 0.4, 0}, {2, 0, 0}},
                                                        {{0.5, 0.5, -1e200}, {0.5, 0.5, 0}},
                                                        {{1.7e308, -1.7e308, 1.7e308}, {2, 0, 2}},
                                                        {{1e-200, -1e-200, 0}, {0, 0, 0}},
                                                        {{2, 2, 1e9}, {2, 2, 2}}};
    for (const auto& [from, to] : far) {
      v1::ExploreRequest question = details;
      v1::Point& point = *question.mutable_anchors(0)->mutable_nearest_vertex();
      point.set_x(from[0]);
      point.set_y(from[1]);
      point.set_z(from[2]);
      const v1::ExploreResponse answer = MustAsk(question);
      ASSERT_EQ(answer.cells_size(), 1) << from[0];
      const v1::Point& at = answer.cells(0).points(0);
      EXPECT_EQ((Point3{at.x(), at.y(), at.z()}), to) << from[0] << " " << from[1] << " " << from[2];
    }
    // Two are equally far: the lower id, in whichever blocks they are.
    v1::ExploreRequest tie = nearest;
    v1::Point& between = *tie.mutable_anchors(0)->mutable_nearest_vertex();
    between.set_x(-1e200);
    between.set_y(0.5);
    between.set_z(2);
    const CellId low = CellId::Parse("v4:4").value(), high = CellId::Parse("v4:6").value();
    const Ids named = MustAskIds(Question(map, low, {0}, 0)), other = MustAskIds(Question(map, high, {0}, 0));
    EXPECT_EQ(MustAskIds(tie), Ids{std::min(*named.begin(), *other.begin())});
  }
}

TEST_F(ExploreTest, ASharedCellIsFoundUnderTheNameOfAnyHexahedronThatHasIt) {
  Make("m", 8);
  const CellId middle = CellId::Parse("v0:7").value();
  for (const char* text : {"v0:7", "v7:0", "v1:6", "v2:5", "v7/0.0:0"}) {
    const CellId alias = CellId::Parse(text).value();
    EXPECT_EQ(MustAskIds(Question("m", alias, {0}, 0)), Ids{middle}) << text;
  }
}

TEST_F(ExploreTest, WrongQuestionsAreTypedErrors) {
  Make("m", 2);
  const v1::ExploreRequest good = Question("m", CellId::Initial(1), {3}, 3);
  EXPECT_EQ(CodeOf(good), grpc::StatusCode::OK);
  auto changed = [&](const std::function<void(v1::ExploreRequest&)>& change) {
    v1::ExploreRequest request = good;
    change(request);
    // The server is that of map "m".
    grpc::ClientContext context;
    auto stub = cluster_.ServerOf("m", 0);
    auto reader = stub->Explore(&context, request);
    v1::ExploreResponse part;
    while (reader->Read(&part)) {
    }
    const grpc::Status status = reader->Finish();
    message_ = status.error_message();
    return status.error_code();
  };
  auto dart = [](uint32_t block, uint32_t index, uint64_t version) {
    return [=](v1::ExploreRequest& r) {
      r.clear_anchors();
      v1::DartRef& d = *r.add_anchors()->mutable_dart();
      d.set_block(block);
      d.set_dart(index);
      d.set_version(version);
    };
  };
  using Code = grpc::StatusCode;
  EXPECT_EQ(changed([](auto& r) { r.set_map("nowhere"); }), Code::NOT_FOUND);
  EXPECT_EQ(changed([](auto& r) { r.clear_anchors(); }), Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.mutable_anchors(0)->Clear(); }), Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.set_close(0, 4); }), Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.set_dimension(4); }), Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.clear_give(); }), Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) {
              for (int k = 0; k < 65; ++k) r.add_close(0);
            }),
            Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.mutable_anchors(0)->mutable_cell()->set_lo(0); }),
            Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.mutable_anchors(0)->set_text("h1/9"); }), Code::INVALID_ARGUMENT);
  EXPECT_THAT(message_, HasSubstr("expected the id of a cell"));
  EXPECT_EQ(changed([](auto& r) { r.mutable_anchors(0)->set_text("h99"); }), Code::NOT_FOUND);
  EXPECT_EQ(changed([](auto& r) { r.mutable_anchors(0)->set_text("h0"); }), Code::NOT_FOUND);
  EXPECT_THAT(message_, HasSubstr("the map has no cell h0"));
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(changed([&](auto& r) { r.mutable_anchors(0)->mutable_point()->set_y(nan); }),
            Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([&](auto& r) { r.mutable_anchors(0)->mutable_nearest_vertex()->set_y(nan); }),
            Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.mutable_anchors(0)->mutable_box()->mutable_lo()->set_x(1); }),
            Code::INVALID_ARGUMENT);
  EXPECT_EQ(changed([](auto& r) { r.set_max_darts(3); }), Code::RESOURCE_EXHAUSTED);
  EXPECT_THAT(message_, HasSubstr("3 darts"));
  EXPECT_THAT(message_, HasSubstr("--max-query-darts"));
  EXPECT_EQ(changed([](auto& r) { r.mutable_anchors(0)->set_block(2); }), Code::NOT_FOUND);
  EXPECT_EQ(changed(dart(7, 0, 0)), Code::NOT_FOUND);
  EXPECT_EQ(changed(dart(1, 4000000000u, 0)), Code::NOT_FOUND);
  EXPECT_EQ(changed(dart(1, 1, 1)), Code::FAILED_PRECONDITION);
  EXPECT_THAT(message_, HasSubstr("ask for its darts again"));
  EXPECT_EQ(changed(dart(1, 1, 0)), Code::OK);
}

TEST_F(ExploreTest, ADartOfAnEarlierMapOfTheSameNameIsStale) {
  Make("m", 2);
  const v1::ExploreResponse before = MustAsk(Question("m", CellId::Initial(1), {3}, 3, v1::GIVE_DARTS));
  grpc::ClientContext context;
  v1::DeleteMapRequest request;
  request.set_map("m");
  v1::DeleteMapResponse response;
  ASSERT_TRUE(cluster_.stub().DeleteMap(&context, request, &response).ok());
  Make("m", 2);
  v1::ExploreRequest stale = Question("m", CellId::Initial(1), {3}, 3);
  stale.clear_anchors();
  v1::DartRef& dart = *stale.add_anchors()->mutable_dart();
  dart.set_block(before.dart_blocks(0));
  dart.set_dart(before.darts(0));
  for (int i = 0; i < before.blocks_size(); ++i) {
    if (before.blocks(i) == dart.block()) dart.set_version(before.versions(i));
  }
  ASSERT_NE(dart.version(), 0u);
  EXPECT_EQ(CodeOf(stale), grpc::StatusCode::FAILED_PRECONDITION);
}

TEST_F(ExploreTest, AServerThatIsGoneIsNamed) {
  Make("m", 3);
  const std::string address = cluster_.server(2).address();
  cluster_.server(2).Stop();
  v1::ExploreRequest request = Question("m", CellId::Initial(1), {3}, 3);
  v1::ExploreResponse all;
  for (size_t s = 0; s < 2; ++s) {
    grpc::ClientContext context;
    auto stub = v1::BlockService::NewStub(service::MakeChannel(cluster_.server(s).address()));
    auto reader = stub->Explore(&context, request);
    while (reader->Read(&all)) {
    }
    const grpc::Status status = reader->Finish();
    EXPECT_EQ(status.error_code(), grpc::StatusCode::UNAVAILABLE);
    EXPECT_THAT(status.error_message(), HasSubstr(address));
  }
}

}  // namespace
}  // namespace ndmap
