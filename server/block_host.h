// SPDX-License-Identifier: GPL-3.0-or-later
// The blocks of one server process: makes and drops them, runs phases on them, delivers batches to them, lets
// queries in. It knows no gRPC service; calls that wait are meant for threads that may (never a callback's).
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/container/flat_hash_map.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "core/algorithm/block_algorithm.h"
#include "core/attributes/table.h"
#include "core/geometry/grid_shape.h"
#include "core/map/block.h"
#include "core/names/initial_cells.h"
#include "ndmap/v1/block_service.pb.h"
#include "server/actor.h"
#include "server/attribute_gates.h"
#include "server/peer_streams.h"
#include "server/piece_store.h"
#include "server/worker_pool.h"

namespace ndmap::server {

// MakeAlgorithm of core/algorithm/registry.h, or a test's.
using AlgorithmFactory = std::function<absl::StatusOr<std::unique_ptr<BlockAlgorithm>>(
    absl::string_view name, const Parameters& parameters, const Environment& environment, Block3& block)>;

struct HostOptions {
  // 0: as many as the machine has cores.
  unsigned threads = 0;
  uint64_t outstanding_limit = 8 << 20;
  // Of all pieces of meshes here, as they were sent; and how long one waits for its map after the last of its
  // upload came.
  uint64_t max_piece_bytes = uint64_t{4} << 30;
  absl::Duration max_piece_time = absl::Minutes(10);
  AlgorithmFactory factory;
  // Lets a test put faults between the blocks and the transport.
  std::function<std::unique_ptr<PeerTransport>(PeerTransport*)> wrap_transport;
};

class BlockHost {
 public:
  explicit BlockHost(HostOptions options);
  ~BlockHost();
  BlockHost(const BlockHost&) = delete;
  BlockHost& operator=(const BlockHost&) = delete;

  // Where this process is reached: batches to blocks placed at this address stay in memory. Before any phase.
  void SetAddress(const std::string& address) { address_ = address; }

  // Keeps a surface for the maps to come; one that is there already stays as it is. When all surfaces here
  // would take more than `max_bytes`, those that no map uses go, the oldest first; RESOURCE_EXHAUSTED if that
  // is not enough.
  absl::Status PutSurface(const std::string& id, TriangleSurface surface, uint64_t max_bytes);
  // Of a mesh: from pieces that wait in pieces(), which then do not any more.
  absl::Status CreateBlocks(const v1::CreateBlocksRequest& request);
  // What names of a block's cells need. FAILED_PRECONDITION when the map has neither grid nor mesh.
  absl::StatusOr<std::shared_ptr<const InitialCells>> Initial(const std::string& map, uint32_t block) const;
  // NOT_FOUND if it is not here, or is another one of that name (`number` other than 0).
  absl::Status DropMap(const std::string& map, uint64_t number = 0);
  // Names and numbers of the maps that are here.
  std::vector<std::pair<std::string, uint64_t>> Maps() const;
  // After a new registration: the coordinator knows nothing of what was here.
  void DropEverything();

  // Phases: as block_service.proto has them. All wait until every block here has done its part.
  absl::Status StartPhase(const v1::StartPhaseRequest& request);
  absl::Status RunPhase(const v1::PhaseKey& key);
  absl::Status PollPhase(const v1::PollPhaseRequest& request, v1::PollPhaseResponse& response);
  absl::Status FinishPhase(const v1::PhaseKey& key, v1::FinishPhaseResponse& response);
  absl::Status CancelPhase(const v1::PhaseKey& key, bool abandon);

  // Hands a batch that came from another process to its block; never waits.
  void Deliver(Envelope envelope, Taken taken);

  // Runs `query` on the block between two steps of what runs there, and waits for it. DATA_LOSS: the block
  // was left half changed, and the query needs a sound one.
  absl::Status Query(const std::string& map, uint32_t block, std::function<absl::Status(Block3&)> query,
                     BlockActor::Needs needs = BlockActor::Needs::kSound);
  // The same for long work: steps of about a millisecond until one returns true or an error. `abandoned`
  // (checked before each step) ends it early.
  absl::Status QuerySliced(const std::string& map, uint32_t block,
                           std::function<absl::StatusOr<bool>(Block3&)> step,
                           std::function<bool()> abandoned);
  // The same with the block's attributes.
  absl::Status Query(const std::string& map, uint32_t block,
                     std::function<absl::Status(Block3&, AttributeStore&)> query,
                     BlockActor::Needs needs = BlockActor::Needs::kSound);
  absl::Status QuerySliced(const std::string& map, uint32_t block,
                           std::function<absl::StatusOr<bool>(Block3&, AttributeStore&)> step,
                           std::function<bool()> abandoned);
  absl::StatusOr<std::shared_ptr<AttributeGates>> Gates(const std::string& map) const;
  // Which state the map is in: the number is that of the last phase that changed it, and the same on all its
  // servers when that has ended. ABORTED while one works.
  absl::StatusOr<uint64_t> AtRest(const std::string& map) const;

  struct MapInfo {
    // Of those that ever had the name.
    uint64_t number = 0;
    uint32_t block_count = 0;
    Routing routing = Routing::kDirect;
    // The blocks here.
    std::vector<uint32_t> blocks;
    // Addresses by block, of the last phase; empty strings before the first.
    std::vector<std::string> addresses;
    // The initial hexahedra, when the map was created with a grid.
    std::optional<GridShape> grid;
    // How many initial cells the whole map has, when it was created from a mesh.
    std::optional<uint64_t> mesh_cells;
  };
  absl::StatusOr<MapInfo> Info(const std::string& map) const;
  size_t map_count() const;

  const std::string& address() const { return address_; }
  PeerStreams& streams() { return streams_; }
  PieceStore& pieces() { return pieces_; }
  // Wakes PollPhase calls that wait; they answer at once from now on.
  void StopWaiting();
  // Ends threads and streams.
  void Stop();

 private:
  struct HostedSurface;
  struct HostedBlock;
  struct HostedMap;
  class Router;

  absl::StatusOr<std::shared_ptr<HostedMap>> Find(absl::string_view map) const;
  absl::StatusOr<std::shared_ptr<HostedMap>> FindPhase(const v1::PhaseKey& key) const;
  absl::StatusOr<HostedBlock*> FindBlock(HostedMap& map, uint32_t block) const;
  // Null: there is nothing that cells could be named by.
  static std::shared_ptr<const InitialCells> InitialOf(const HostedMap& map, HostedBlock& block);
  void Abandon(HostedMap& map);
  // Ends everything that runs for the map and forgets it; returns when it is gone, whoever does it.
  void Drop(HostedMap& map);
  absl::Status QueryActor(BlockActor& actor, const std::shared_ptr<Block3>& block,
                          std::function<absl::StatusOr<bool>(Block3&)> step, std::function<bool()> abandoned);
  // The bounds of the block's vertices, found a step at a time on its turns.
  absl::StatusOr<Box3> Bounds(HostedBlock& hosted);
  // An algorithm for each block here, in their order.
  absl::Status MakeAlgorithms(HostedMap& map, const v1::Phase& phase,
                              std::vector<std::unique_ptr<BlockAlgorithm>>& made);
  // Of a request that has a mesh: what each block there is to know of it.
  absl::Status ClaimPieces(const v1::CreateBlocksRequest& request, HostedMap& map);
  // Some map here holds its content.
  bool Used(const HostedSurface& surface) const ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  const HostOptions options_;
  const unsigned threads_;
  std::string address_;
  PeerStreams streams_;
  PieceStore pieces_;
  std::unique_ptr<Router> router_;
  std::unique_ptr<PeerTransport> wrapped_;
  WorkerPool pool_;

  mutable absl::Mutex mutex_;
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  absl::flat_hash_map<std::string, std::shared_ptr<HostedMap>> maps_ ABSL_GUARDED_BY(mutex_);
  absl::flat_hash_map<std::string, std::shared_ptr<const HostedSurface>> surfaces_ ABSL_GUARDED_BY(mutex_);
  uint64_t last_surface_ ABSL_GUARDED_BY(mutex_) = 0;
};

}  // namespace ndmap::server
