// SPDX-License-Identifier: GPL-3.0-or-later
// How fast a client asks for betas of a map of a running cluster: one at a time, many at a time, while blocks
// refine, and a traversal of the whole map through the SDK's Navigator, beside the same traversal of one
// plain CGAL linear cell complex in this process. Prints one JSON object.
//
//   bench_navigate 127.0.0.1:7000 torus --busy busy --busy-depth 5
#include <CGAL/Cell_attribute.h>
#include <CGAL/Cell_attribute_with_point.h>
#include <CGAL/Linear_cell_complex_for_combinatorial_map.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "absl/container/flat_hash_map.h"
#include "absl/status/statusor.h"
#include "absl/strings/str_cat.h"
#include "client/sdk/client.h"
#include "client/sdk/explore.h"
#include "client/sdk/navigator.h"

namespace ndmap {
namespace {

using Json = nlohmann::json;
using Clock = std::chrono::steady_clock;

double SecondsSince(Clock::time_point begin) {
  return std::chrono::duration<double>(Clock::now() - begin).count();
}

double Seconds(const timeval& t) {
  return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
}

[[noreturn]] void Fail(const absl::Status& status) {
  std::cerr << "bench_navigate: " << status.message() << "\n";
  std::exit(1);
}

// Wall, user and system seconds of this process and, if there is a map, of its servers.
class Stopwatch {
 public:
  explicit Stopwatch(const MapHandle* map = nullptr) : map_(map), first_(Now()) {}
  Json Read() const {
    const Sample now = Now();
    Json json = {{"wall", now.wall - first_.wall}};
    json["client"] = {{"user", now.client[0] - first_.client[0]},
                      {"system", now.client[1] - first_.client[1]}};
    if (map_ != nullptr) {
      json["servers"] = {{"user", now.servers[0] - first_.servers[0]},
                         {"system", now.servers[1] - first_.servers[1]}};
    }
    return json;
  }
  double Wall() const { return Now().wall - first_.wall; }

 private:
  struct Sample {
    double wall = 0;
    std::array<double, 2> client{}, servers{};
  };
  Sample Now() const {
    Sample sample;
    if (map_ != nullptr) {
      const absl::StatusOr<std::vector<v1::ProcessStats>> servers = map_->ServerStats();
      if (!servers.ok()) Fail(servers.status());
      for (const v1::ProcessStats& server : *servers) {
        sample.servers[0] += server.user_seconds();
        sample.servers[1] += server.system_seconds();
      }
    }
    rusage usage;
    getrusage(RUSAGE_SELF, &usage);
    sample.client = {Seconds(usage.ru_utime), Seconds(usage.ru_stime)};
    sample.wall = std::chrono::duration<double>(Clock::now().time_since_epoch()).count();
    return sample;
  }

  const MapHandle* const map_;
  const Sample first_;
};

// Milliseconds: percentiles and the worst.
Json Summary(std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  if (seconds.empty()) return {{"samples", 0}};
  const auto at = [&](double part) {
    return 1e3 * seconds[std::min(seconds.size() - 1,
                                  static_cast<size_t>(part * static_cast<double>(seconds.size())))];
  };
  std::vector<double> worst;
  for (size_t i = 0; i < 5 && i < seconds.size(); ++i) worst.push_back(1e3 * seconds[seconds.size() - 1 - i]);
  return {{"samples", seconds.size()}, {"p50", at(0.5)},  {"p90", at(0.9)},
          {"p99", at(0.99)},           {"max", worst[0]}, {"worst", worst}};
}

Json Latency(int samples, const std::function<absl::Status(int)>& question) {
  for (int i = 0; i < samples / 10; ++i) {
    if (absl::Status s = question(i); !s.ok()) Fail(s);
  }
  std::vector<double> seconds;
  for (int i = 0; i < samples; ++i) {
    const auto begin = Clock::now();
    if (absl::Status s = question(i); !s.ok()) Fail(s);
    seconds.push_back(SecondsSince(begin));
  }
  return Summary(std::move(seconds));
}

// --- The traversal: the same code over a view and over a CGAL map. ---

// Goes from dart to dart by beta 1, 2 and 3 until every dart was met, and so every hexahedron. `Over` tells
// whether a dart was met for the first time, and its betas; Visit is called with each.
template <class Over, class Visit>
size_t Traverse(Over& over, typename Over::Dart start, Visit visit) {
  std::vector<typename Over::Dart> stack = {start};
  over.Meet(start);
  size_t hexahedra = 0;
  while (!stack.empty()) {
    const typename Over::Dart d = stack.back();
    stack.pop_back();
    if (over.MeetCell(d)) ++hexahedra;
    visit(d);
    for (int i = 1; i <= 3; ++i) {
      const typename Over::Dart next = over.Beta(d, i);
      if (!over.IsNone(next) && over.Meet(next)) stack.push_back(next);
    }
  }
  return hexahedra;
}

class OverView {
 public:
  using Dart = Navigator::Dart;
  OverView(Navigator& view, size_t blocks) : view_(view), met_(blocks) {}
  Dart Beta(Dart d, int i) {
    const absl::StatusOr<Dart> next = view_.Beta(d, i);
    if (!next.ok()) Fail(next.status());
    return *next;
  }
  bool IsNone(Dart d) const { return d.is_free(); }
  bool Meet(Dart d) { return First(met_[d.block], d.index); }
  bool MeetCell(Dart d) {
    const absl::StatusOr<const Navigator::Cell*> cell = view_.CellOf(d);
    if (!cell.ok()) Fail(cell.status());
    return First(cells_, (*cell)->number);
  }
  double X(Dart d) { return view_.Point(d).value()[0]; }

 private:
  static bool First(std::vector<bool>& met, uint32_t i) {
    if (i >= met.size()) met.resize(std::max<size_t>(2 * met.size(), i + 1));
    if (met[i]) return false;
    met[i] = true;
    return true;
  }
  Navigator& view_;
  std::vector<std::vector<bool>> met_;
  std::vector<bool> cells_;
};

struct Items {
  template <class Refs>
  struct Dart_wrapper {
    using Attributes =
        std::tuple<CGAL::Cell_attribute_with_point<Refs>, void, void, CGAL::Cell_attribute<Refs, uint32_t>>;
  };
};
using Lcc = CGAL::Linear_cell_complex_for_combinatorial_map<3, 3, CGAL::Linear_cell_complex_traits<3>, Items>;

class OverCgal {
 public:
  using Dart = Lcc::Dart_handle;
  explicit OverCgal(Lcc& lcc) : lcc_(lcc), mark_(lcc.get_new_mark()), cells_(lcc.number_of_attributes<3>()) {}
  ~OverCgal() { lcc_.free_mark(mark_); }
  Dart Beta(Dart d, int i) const { return lcc_.beta(d, i); }
  bool IsNone(Dart d) const { return d == lcc_.null_dart_handle; }
  bool Meet(Dart d) {
    if (lcc_.is_marked(d, mark_)) return false;
    lcc_.mark(d, mark_);
    return true;
  }
  bool MeetCell(Dart d) {
    const uint32_t number = lcc_.info<3>(d);
    if (cells_[number]) return false;
    cells_[number] = true;
    return true;
  }
  double X(Dart d) const { return lcc_.point(d).x(); }

 private:
  Lcc& lcc_;
  const Lcc::size_type mark_;
  std::vector<bool> cells_;
};

// The map of the view as one CGAL map, its darts in the order of blocks and indices. Returns the handle of
// the dart that comes first in `all`.
OverCgal::Dart CopyToCgal(Navigator& view, std::vector<Navigator::Dart> all, Lcc& lcc) {
  const Navigator::Dart start = all[0];
  std::sort(all.begin(), all.end(), [](const Navigator::Dart& a, const Navigator::Dart& b) {
    return std::pair(a.block, a.index) < std::pair(b.block, b.index);
  });
  absl::flat_hash_map<Navigator::Dart, OverCgal::Dart> made;
  for (const Navigator::Dart& d : all) made[d] = lcc.create_dart();
  absl::flat_hash_map<uint32_t, Lcc::Attribute_handle<3>::type> cells;
  std::map<std::array<double, 3>, Lcc::Vertex_attribute_handle> vertices;
  for (const Navigator::Dart& d : all) {
    const OverCgal::Dart mine = made[d];
    lcc.basic_link_beta_1(mine, made[view.Beta(d, 1).value()]);
    for (int i : {2, 3}) {
      const Navigator::Dart other = view.Beta(d, i).value();
      if (other.is_free() || !lcc.is_free(mine, static_cast<unsigned>(i))) continue;
      if (i == 2) lcc.basic_link_beta_for_involution<2>(mine, made[other]);
      if (i == 3) lcc.basic_link_beta_for_involution<3>(mine, made[other]);
    }
    const uint32_t number = view.CellOf(d).value()->number;
    auto [cell, is_new] = cells.try_emplace(number);
    if (is_new) cell->second = lcc.create_attribute<3>(number);
    lcc.set_dart_attribute<3>(mine, cell->second);
    const std::array<double, 3> p = view.Point(d).value();
    auto [vertex, new_vertex] = vertices.try_emplace(p);
    if (new_vertex) vertex->second = lcc.create_vertex_attribute(Lcc::Point(p[0], p[1], p[2]));
    lcc.set_dart_attribute<0>(mine, vertex->second);
  }
  return made[start];
}

Json Traversal(const Stopwatch& watch, size_t hexahedra, size_t darts) {
  Json json = watch.Read();
  json["hexahedra"] = hexahedra;
  json["darts"] = darts;
  return json;
}

template <class Over>
double SumOfX(Over& over, typename Over::Dart start) {
  double sum = 0;
  Traverse(over, start, [&](typename Over::Dart d) { sum += over.X(d); });
  return sum;
}

// All darts of the map, in the order in which the traversal meets them.
std::vector<Navigator::Dart> Traversals(const MapHandle& map, int repeat, Json& json) {
  const size_t blocks = map.info().block_count();
  std::vector<Navigator::Dart> all;
  Navigator view(map);
  const v1::DartRef some = map.AnyDart(0).value().dart();
  const Navigator::Dart start{some.block(), some.dart()};
  {
    OverView over(view, blocks);
    const Stopwatch watch(&map);
    const size_t hexahedra = Traverse(over, start, [&](Navigator::Dart d) { all.push_back(d); });
    json["cold"] = Traversal(watch, hexahedra, all.size());
    const Navigator::Counters counters = view.counters();
    json["fetched"] = {{"fetches", counters.fetches}, {"bytes", counters.bytes}};
  }
  Lcc lcc;
  const OverCgal::Dart first = CopyToCgal(view, all, lcc);
  double sum = 0;
  for (int k = 0; k < repeat; ++k) {
    {
      OverView over(view, blocks);
      const Stopwatch watch;
      const size_t hexahedra = Traverse(over, start, [](Navigator::Dart) {});
      json["warm"].push_back(Traversal(watch, hexahedra, all.size()));
    }
    {
      OverCgal over(lcc);
      const Stopwatch watch;
      const size_t hexahedra = Traverse(over, first, [](OverCgal::Dart) {});
      json["cgal"].push_back(Traversal(watch, hexahedra, lcc.number_of_darts()));
    }
    {
      OverView over(view, blocks);
      const Stopwatch watch;
      sum = SumOfX(over, start);
      json["warm_points"].push_back(watch.Read());
    }
    OverCgal over(lcc);
    const Stopwatch watch;
    const double expected = SumOfX(over, first);
    json["cgal_points"].push_back(watch.Read());
    // The same darts in the same order: the same sum, to the bit.
    if (sum != expected) Fail(absl::InternalError(absl::StrCat("the sums differ: ", sum, ", ", expected)));
  }
  return all;
}

// --- Questions to the services. ---

DartColumns One(const Navigator::Dart& d) { return {{d.block}, {d.index}, {}}; }

Json Latencies(const MapHandle& map, const std::vector<Navigator::Dart>& all, int samples) {
  std::mt19937 random(1);
  std::vector<Navigator::Dart> darts;
  for (int i = 0; i < samples; ++i) darts.push_back(all[random() % all.size()]);
  Json json;
  json["beta"] =
      Latency(samples, [&](int i) { return map.Walk(One(darts[static_cast<size_t>(i)]), {1}).status(); });
  json["beta_described"] = Latency(samples, [&](int i) {
    v1::DartRef ref;
    ref.set_block(darts[static_cast<size_t>(i)].block);
    ref.set_dart(darts[static_cast<size_t>(i)].index);
    return map.Beta({ref}, {1}).status();
  });
  json["two_ring"] = Latency(samples / 10, [&](int i) {
    const Navigator::Dart& d = darts[static_cast<size_t>(i)];
    return map.Explore(Ring(DartAnchor(d.block, d.index), 3, 2, 2)).status();
  });
  return json;
}

Json Batched(const MapHandle& map, const std::vector<Navigator::Dart>& all, double seconds) {
  const auto columns = [](const std::vector<Navigator::Dart>& darts) {
    DartColumns starts;
    for (const Navigator::Dart& d : darts) {
      starts.blocks.push_back(d.block);
      starts.darts.push_back(d.index);
    }
    return starts;
  };
  std::vector<Navigator::Dart> scattered = all;
  std::shuffle(scattered.begin(), scattered.end(), std::mt19937(1));
  const std::vector<std::pair<std::string, DartColumns>> orders = {{"as traversed", columns(all)},
                                                                   {"scattered", columns(scattered)}};
  Json json = Json::array();
  for (const std::vector<uint8_t>& word : std::vector<std::vector<uint8_t>>{{1}, {3}, {1, 2, 3, 2}}) {
    for (const auto& [order, starts] : orders) {
      uint64_t betas = 0;
      const Stopwatch watch(&map);
      do {
        const absl::StatusOr<WalkedColumns> walked = map.Walk(starts, word);
        if (!walked.ok()) Fail(walked.status());
        for (uint32_t used : walked->used) betas += used;
      } while (watch.Wall() < seconds);
      Json row = watch.Read();
      row["order"] = order;
      row["word"] = std::string();
      for (uint8_t letter : word) row["word"] = row["word"].get<std::string>() + std::to_string(letter);
      row["betas"] = betas;
      json.push_back(std::move(row));
    }
  }
  return json;
}

// One beta after the other while a job refines the map, asked of a block that works.
Json WhileRefining(const MapHandle& map, int depth) {
  const v1::DartRef some = map.AnyDart(0).value().dart();
  v1::Phase phase;
  phase.set_algorithm("refine");
  (*phase.mutable_parameters())["oracle"] = "surface";
  (*phase.mutable_parameters())["depth"] = absl::StrCat(depth);
  const absl::StatusOr<JobHandle> job = map.StartJob("refine", {phase});
  if (!job.ok()) Fail(job.status());
  std::atomic<bool> working{false}, over{false};
  std::thread watcher([&] {
    const auto progress = [&](const v1::JobProgress& p) {
      for (const v1::BlockProgress& block : p.blocks()) {
        if (block.block() == some.block()) working = !block.idle();
      }
    };
    const absl::StatusOr<v1::Job> ended = job->Wait(progress, absl::Milliseconds(10));
    over = true;
    if (!ended.ok()) Fail(ended.status());
    if (absl::Status s = StatusOf(*ended); !s.ok()) Fail(s);
  });
  std::vector<double> seconds;
  while (!over) {
    const bool before = working;
    const auto begin = Clock::now();
    // Refinement adds darts and takes none away.
    const absl::Status status = map.Walk({{some.block()}, {some.dart()}, {}}, {1}).status();
    if (!status.ok()) Fail(status);
    if (before && working) seconds.push_back(SecondsSince(begin));
  }
  watcher.join();
  return Summary(std::move(seconds));
}

}  // namespace
}  // namespace ndmap

int main(int argc, char** argv) {
  using namespace ndmap;
  CLI::App app("Betas of a map of a running cluster, timed");
  std::string coordinator, name, busy;
  int samples = 10000, repeat = 3, busy_depth = 5;
  double seconds = 2;
  app.add_option("coordinator", coordinator, "HOST:PORT")->required();
  app.add_option("map", name, "A map that nobody changes")->required();
  app.add_option("--busy", busy, "A map of initial hexahedra only: it is refined meanwhile");
  app.add_option("--busy-depth", busy_depth, "To this depth")->check(CLI::Range(1, 20));
  app.add_option("--samples", samples, "Of one beta; a tenth of it of 2-rings")
      ->check(CLI::Range(10, 10000000));
  app.add_option("--repeat", repeat, "Traversals of each kind")->check(CLI::Range(1, 1000));
  app.add_option("--seconds", seconds, "Of each kind of batches")->check(CLI::Range(0.01, 1e4));
  CLI11_PARSE(app, argc, argv);
  const absl::StatusOr<Client> client = Client::Connect(coordinator);
  if (!client.ok()) Fail(client.status());
  const absl::StatusOr<MapHandle> map = client->OpenMap(name);
  if (!map.ok()) Fail(map.status());
  Json json;
  json["blocks"] = map->info().block_count();
  const std::vector<Navigator::Dart> all = Traversals(*map, repeat, json["traversal"]);
  json["latency"] = Latencies(*map, all, samples);
  json["batched"] = Batched(*map, all, seconds);
  if (!busy.empty()) {
    const absl::StatusOr<MapHandle> other = client->OpenMap(busy);
    if (!other.ok()) Fail(other.status());
    json["latency"]["beta_while_refining"] = WhileRefining(*other, busy_depth);
  }
  std::cout << json.dump(1) << "\n";
  return 0;
}
