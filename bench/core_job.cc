// SPDX-License-Identifier: GPL-3.0-or-later
// The main job without services: all blocks in this process, one after the other, messages handed over
// directly. What the algorithms and the map cost alone, and what to profile. Prints JSON.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <chrono>
#include <iostream>
#include <memory>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/algorithm/build/build.h"
#include "core/algorithm/registry.h"
#include "core/geometry/surface_caches.h"
#include "core/io/sample_surface.h"
#include "core/io/surface_reader.h"

namespace {

using ndmap::BlockAlgorithm;
using ndmap::BlockId;
using ndmap::Message;

// Steps a call: nobody waits for a turn here.
constexpr size_t kBudget = 1 << 20;

double Cpu(const timeval& t) { return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec); }

// Hands each message over at once... to its block's queue.
class Queues final : public ndmap::Outbox {
 public:
  explicit Queues(size_t blocks) : batches_(blocks * blocks), blocks_(blocks) {}
  void set_self(size_t self) { self_ = self; }
  void Send(BlockId to, const Message& message) override {
    batches_[self_ * blocks_ + to.value].Add(message);
    ++sent_;
  }
  void Broadcast(const Message& message) override {
    for (size_t b = 0; b < blocks_; ++b) {
      if (b != self_) Send(BlockId{static_cast<uint32_t>(b)}, message);
    }
  }
  ndmap::MessageBatch Take(size_t from, size_t to) {
    ndmap::MessageBatch batch;
    std::swap(batch, batches_[from * blocks_ + to]);
    return batch;
  }
  int64_t sent() const { return sent_; }

 private:
  std::vector<ndmap::MessageBatch> batches_;
  const size_t blocks_;
  size_t self_ = 0;
  int64_t sent_ = 0;
};

absl::StatusOr<ndmap::Report> RunPhase(std::vector<std::unique_ptr<BlockAlgorithm>>& algorithms,
                                       Queues& queues) {
  for (auto& a : algorithms) {
    absl::StatusOr<bool> started = false;
    while (started.ok() && !*started) started = a->Start(kBudget);
    if (!started.ok()) return started.status();
  }
  for (bool busy = true; busy;) {
    busy = false;
    for (size_t b = 0; b < algorithms.size(); ++b) {
      queues.set_self(b);
      for (size_t from = 0; from < algorithms.size(); ++from) {
        const ndmap::MessageBatch batch = queues.Take(from, b);
        for (size_t i = 0; i < batch.size(); ++i) {
          auto s = algorithms[b]->Receive(BlockId{static_cast<uint32_t>(from)}, batch[i], queues);
          if (!s.ok()) return s;
        }
        busy = busy || !batch.empty();
      }
      if (!algorithms[b]->HasWork()) continue;
      busy = true;
      if (auto s = algorithms[b]->Work(kBudget, queues); !s.ok()) return s.status();
    }
  }
  ndmap::Report report;
  for (auto& a : algorithms) {
    absl::StatusOr<bool> finished = false;
    while (finished.ok() && !*finished) finished = a->Finish(kBudget);
    if (!finished.ok()) return finished.status();
    report.Merge(a->report());
  }
  return report;
}

struct Job {
  std::vector<std::unique_ptr<ndmap::Block3>> blocks;
  std::vector<ndmap::Environment> environments;
  std::unique_ptr<Queues> queues;

  absl::Status Run(const std::string& algorithm, const ndmap::Parameters& parameters) {
    rusage before{}, after{};
    getrusage(RUSAGE_SELF, &before);
    const auto begin = std::chrono::steady_clock::now();
    std::vector<std::unique_ptr<BlockAlgorithm>> algorithms;
    for (size_t b = 0; b < blocks.size(); ++b) {
      auto made = ndmap::MakeAlgorithm(algorithm, parameters, environments[b], *blocks[b]);
      if (!made.ok()) return made.status();
      algorithms.push_back(*std::move(made));
    }
    auto report = RunPhase(algorithms, *queues);
    if (!report.ok()) return report.status();
    algorithms.clear();
    const double wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    getrusage(RUSAGE_SELF, &after);
    std::cout << "  {\"phase\": \"" << algorithm << "\", \"wall\": " << wall
              << ", \"user\": " << Cpu(after.ru_utime) - Cpu(before.ru_utime)
              << ", \"system\": " << Cpu(after.ru_stime) - Cpu(before.ru_stime)
              << ", \"peak_rss_bytes\": " << after.ru_maxrss * 1024L << ", \"messages\": " << queues->sent();
    for (const auto& [name, count] : report->counts) std::cout << ", \"" << name << "\": " << count;
    std::cout << ", \"digest\": \"" << report->digest.ToString() << "\"},\n";
    return absl::OkStatus();
  }
};

absl::Status Main(const std::string& path, const std::string& grid_text, uint32_t cubes, int depth,
                  uint32_t blocks, const std::string& partition, bool broadcast, int parts) {
  ndmap::TriangleSurface surface;
  auto file = ndmap::ReadSurface(path, {});
  if (!file.ok()) return file.status();
  auto shared = std::make_shared<const ndmap::TriangleSurface>(std::move(file->surface));
  absl::StatusOr<ndmap::GridShape> grid;
  if (cubes != 0) {
    grid = ndmap::GridFromCubes(ndmap::BoundingBox(*shared), cubes);
  } else if (!grid_text.empty()) {
    auto cells = ndmap::ParseCells(grid_text);
    if (!cells.ok()) return cells.status();
    grid = ndmap::GridFromCounts(ndmap::BoundingBox(*shared), *cells);
  } else {
    grid = ndmap::GridAuto(ndmap::BoundingBox(*shared));
  }
  if (!grid.ok()) return grid.status();
  auto assignment = ndmap::MakeAssignment(*grid, blocks, partition, shared.get(), depth);
  if (!assignment.ok()) return assignment.status();
  Job job;
  auto parity = std::make_shared<ndmap::ParityCache>();
  for (uint32_t b = 0; b < blocks; ++b) {
    job.blocks.push_back(std::make_unique<ndmap::Block3>(BlockId{b}));
    job.environments.push_back({BlockId{b}, blocks,
                                broadcast ? ndmap::Routing::kBroadcast : ndmap::Routing::kDirect, shared,
                                std::make_shared<ndmap::IndexCache>(), parity});
  }
  job.queues = std::make_unique<Queues>(blocks);
  std::cout << "[\n";
  if (auto s = job.Run("build", ndmap::GridParameters(*grid, *assignment)); !s.ok()) return s;
  for (int level = 0; level < depth; ++level) {
    ndmap::Parameters parameters;
    parameters.Set("depth", int64_t{depth}).Set("level", int64_t{level});
    const bool last = level + 1 == depth;
    // As `ndmap run` does it (client/cli/run_phases.h).
    for (int part = 0; part < (last ? std::max(parts, 1) : 1); ++part) {
      if (last && parts > 1) {
        std::string children;
        for (int child = part; child < 8; child += parts) children += static_cast<char>('0' + child);
        parameters.Set("children", children);
      }
      if (auto s = job.Run("refine", parameters); !s.ok()) return s;
      if (parts == 0 || level + 2 < depth || (last && part + 1 == parts)) continue;
      if (auto s = job.Run("classify", {}); !s.ok()) return s;
      if (auto s = job.Run("trim", {}); !s.ok()) return s;
    }
  }
  for (const char* phase : {"classify", "trim", "count", "hash", "check"}) {
    if (auto s = job.Run(phase, {}); !s.ok()) return s;
  }
  std::cout << "  {}\n]\n";
  return absl::OkStatus();
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("The main job without services, in one process.");
  std::string path, grid, partition = "hilbert";
  uint32_t cubes = 0, blocks = 1;
  int depth = 4, parts = 0;
  bool broadcast = false;
  app.add_option("surface", path)->required();
  app.add_option("--grid", grid);
  app.add_option("--cubes", cubes);
  app.add_option("--depth", depth);
  app.add_option("--blocks", blocks);
  app.add_option("--partition", partition);
  app.add_flag("--broadcast", broadcast);
  app.add_option("--parts", parts, "erase early, the last level in so many parts (0: erase at the end)");
  CLI11_PARSE(app, argc, argv);
  const absl::Status status = Main(path, grid, cubes, depth, blocks, partition, broadcast, parts);
  if (!status.ok()) std::cerr << status << "\n";
  return status.ok() ? 0 : 1;
}
