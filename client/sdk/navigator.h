// SPDX-License-Identifier: Apache-2.0
// Walks dart by dart near the speed of memory: a view of a map that fetches whole chunks of hexahedra when a
// walk first comes to them, and keeps them.
//
//   ndmap::Navigator view(map);
//   ndmap::Navigator::Dart d = view.DartOf(start).value();
//   for (int i : {1, 2, 3}) d = view.Beta(d, i).value();
//
// All that a view answers is of one version of each block: the one that it first met. When a block has
// changed since and more of it is needed, the answer is FAILED_PRECONDITION; Refresh() forgets everything. A
// view may be used by any number of threads: what is there is read without locks, one thread at a time
// fetches.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "client/sdk/map.h"
#include "client/sdk/paged_table.h"

namespace ndmap {

class Navigator {
 public:
  struct Dart {
    uint32_t block = 0;
    // kFree: no dart, what beta gives at the boundary of the map.
    uint32_t index = kFree;

    static constexpr uint32_t kFree = 0xffffffff;
    bool is_free() const { return index == kFree; }
    friend bool operator==(const Dart&, const Dart&) = default;
    template <typename H>
    friend H AbslHashValue(H h, const Dart& d) {
      return H::combine(std::move(h), d.block, d.index);
    }
  };
  struct Cell {
    v1::CellId id;
    // 0 unknown, 1 outside, 2 inside, 3 cut.
    uint32_t state = 0;
    uint32_t darts = 0;
    // Of this view: 0, 1, ... in the order in which hexahedra were fetched, for arrays beside the view.
    uint32_t number = 0;
  };
  struct Counters {
    uint64_t fetches = 0;
    uint64_t hexahedra = 0;
    uint64_t darts = 0;
    uint64_t bytes = 0;
  };

  explicit Navigator(MapHandle map);
  ~Navigator();
  Navigator(const Navigator&) = delete;
  Navigator& operator=(const Navigator&) = delete;

  // A dart that a service named, in this view. FAILED_PRECONDITION when the view is of another version.
  absl::StatusOr<Dart> DartOf(const v1::DartRef& dart);

  // beta_i, 0 <= i <= 3, wherever it leads; a free dart at the boundary. O(1) in memory when the hexahedron
  // is there, a fetch otherwise. INVALID_ARGUMENT for another i, NOT_FOUND for a dart that the block does not
  // have, FAILED_PRECONDITION when its block has changed.
  absl::StatusOr<Dart> Beta(Dart dart, int i);
  // Where the dart starts.
  absl::StatusOr<std::array<double, 3>> Point(Dart dart);
  // The hexahedron of the dart; stays where it is until Refresh().
  absl::StatusOr<const Cell*> CellOf(Dart dart);

  // Forgets everything; darts of before are gone. No other call may be under way.
  void Refresh();
  Counters counters() const;

 private:
  struct BlockView;
  // What is known of a dart; published by storing beta1 last.
  struct Links {
    std::atomic<uint32_t> beta1{0};  // 0: not fetched. 0xffffffff is never beta 1.
    uint32_t beta0 = Dart::kFree;
    uint32_t beta2 = Dart::kFree;
    // In `beta3_block`, which is the own block but for critical darts.
    uint32_t beta3 = Dart::kFree;
    uint32_t beta3_block = 0;
    uint32_t vertex = 0;
    uint32_t cell = 0;
  };

  absl::StatusOr<const Links*> LinksOf(Dart dart) {
    if (const Links* links = Known(dart)) return links;
    return Fetch(dart);
  }
  const Links* Known(Dart dart) const;
  absl::StatusOr<const Links*> Fetch(Dart dart) ABSL_LOCKS_EXCLUDED(mutex_);
  absl::StatusOr<std::vector<v1::FetchCellsResponse>> Ask(const Dart& dart, uint64_t version) const;
  // Whether a part of a chunk fits together, and is of the versions of this view.
  absl::Status Check(const v1::FetchCellsResponse& part) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status Add(const v1::FetchCellsResponse& part) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Publish(const v1::FetchCellsResponse& part) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  absl::Status SetVersion(uint32_t block, uint64_t version) ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const MapHandle map_;
  // By block; read without the lock.
  std::vector<std::unique_ptr<BlockView>> blocks_;
  internal::PagedTable<Cell> cells_;
  mutable absl::Mutex mutex_;
  Counters counters_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap
