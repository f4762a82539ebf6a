// SPDX-License-Identifier: GPL-3.0-or-later
// The one abstraction that carries the project: a distributed algorithm sees one block. It is started with
// parameters, is handed messages, works for a budget of steps at a time, emits messages for other blocks,
// says whether it has work left, and reports. It never blocks, reads no clock and opens no socket. The
// simulator (core/sim) runs k of them in one thread under a seeded scheduler; the block server hosts the same
// class over gRPC; the coordinator knows only phases: start on every block, wait for quiescence, finish, next
// phase.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "absl/container/btree_map.h"
#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "core/algorithm/message.h"
#include "core/algorithm/parameters.h"
#include "core/geometry/surface.h"
#include "core/map/ids.h"

namespace ndmap {

class AttributeStore;
class IndexCache;
class InitialCells;
class ParityCache;
class ParityIndex;
class SurfaceIndex;

enum class Routing { kDirect, kBroadcast };

// What an algorithm found in its block. Blocks' reports add up to the map's: counts are summed, digests are
// added modulo 2^128, findings are appended.
struct Report {
  absl::btree_map<std::string, int64_t> counts;
  Digest digest;
  // Sentences about faults found (a checker's), at most kMaxFindings; the count "findings" has their true
  // number.
  std::vector<std::string> findings;
  static constexpr size_t kMaxFindings = 20;

  void Find(std::string sentence);
  void Merge(const Report& other);
};

// Where a block is: the same on every block but for `self`.
struct Environment {
  BlockId self;
  uint32_t block_count = 1;
  Routing routing = Routing::kDirect;
  // The surface that the map was made for; null when there is none.
  std::shared_ptr<const TriangleSurface> surface;
  // Where the block's part of the surface's index stays from one phase to the next; null: each phase makes
  // its own.
  std::shared_ptr<IndexCache> index_cache;
  // Where the surface's parity stays, for all blocks; null: each phase makes its own.
  std::shared_ptr<ParityCache> parity_cache = nullptr;
  // The bounds of the block's hexahedra, for a host whose block belongs to another thread: waits for it.
  // Empty: whoever makes an algorithm may look at the block itself.
  std::function<absl::StatusOr<Box3>()> bounds = nullptr;
  // What names of vertices, edges and faces need to know of the initial mesh; null when it is not known.
  std::shared_ptr<const InitialCells> initial = nullptr;
  // Where the block's attributes stay; null: each phase makes its own.
  std::shared_ptr<AttributeStore> attributes = nullptr;

  // The index of the triangles near the block, whose bounds are bounds(), or else `look()`; they are asked
  // only when there is no index yet. FAILED_PRECONDITION without a surface. The first call for a block costs
  // O(t log t) of its t triangles: for the making of an algorithm, never for its steps.
  absl::StatusOr<std::shared_ptr<const SurfaceIndex>> Index(absl::FunctionRef<Box3()> look) const;
  // The parity of the surface. As above; the first call for a surface costs O(t).
  absl::StatusOr<std::shared_ptr<const ParityIndex>> Parity() const;
};

// Making one may take long (an index of the surface) and does not touch the block, which may be at work, but
// through Environment::Index. Every later call is short: what grows with the block is done in steps of some
// microseconds, at most `budget` of them a call.
class BlockAlgorithm {
 public:
  virtual ~BlockAlgorithm() = default;

  // Whether it changes the block: then one that is thrown out of in the middle leaves the block of no use.
  virtual bool changes_map() const { return true; }

  // Gets ready, at most `budget` steps at a time: called until it says true, on every block before any
  // message of the phase is received anywhere and before any work. It does not change the block.
  virtual absl::StatusOr<bool> Start(size_t budget) = 0;

  // Applies one message, whatever the memory limit says. Idempotent: duplicates do nothing. An error fails
  // the job.
  virtual absl::Status Receive(BlockId from, const Message& message, Outbox& out) = 0;

  // Does about `budget` steps of the block's own work (a step is a hexahedron's test or split, or a dart);
  // returns how many it did. An error fails the job.
  virtual absl::StatusOr<size_t> Work(size_t budget, Outbox& out) = 0;

  // True when there is own work left. Messages may make new work.
  virtual bool HasWork() const = 0;

  // Stops own work at the next safe place: the map is valid, and HasWork() is false soon and stays so;
  // messages of others are still applied. At any time, also while Start() has not said true: it is called on
  // until it does. A result that is not whole is not reported: the count "cancelled" is.
  virtual void Cancel() = 0;

  // Called at quiescence until it says true: what is still kept then is an error that names the label.
  virtual absl::StatusOr<bool> Finish(size_t budget) = 0;

  // Cheap; at any time between other calls, for progress, and after Finish() has said true for the result.
  virtual Report report() const = 0;
};

}  // namespace ndmap
