// SPDX-License-Identifier: GPL-3.0-or-later
// What a block server keeps of one map.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"
#include "server/block_host.h"

namespace ndmap::server {

struct BlockHost::HostedBlock {
  explicit HostedBlock(BlockId id) : block(id) {}
  // Touched only by its actor's tasks and algorithm.
  Block3 block;
  // The block's part of the surface, indexed, from one phase to the next.
  std::shared_ptr<IndexCache> index_cache = std::make_shared<IndexCache>();
  std::shared_ptr<BlockActor> actor;
};

struct BlockHost::HostedMap {
  std::string name;
  uint32_t block_count = 0;
  Routing routing = Routing::kDirect;
  std::shared_ptr<const TriangleSurface> surface;
  std::optional<GridShape> grid;
  // Does not change after the map was made; closures of actors hold the block.
  std::map<uint32_t, std::shared_ptr<HostedBlock>> blocks;

  absl::Mutex mutex;
  bool in_phase ABSL_GUARDED_BY(mutex) = false;
  PhaseId phase ABSL_GUARDED_BY(mutex);
  std::vector<std::string> addresses ABSL_GUARDED_BY(mutex);
  // Raised whenever a block comes to rest; wakes PollPhase.
  uint64_t rests ABSL_GUARDED_BY(mutex) = 0;
};

}  // namespace ndmap::server
