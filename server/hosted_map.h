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
#include "core/attributes/table.h"
#include "core/geometry/surface_caches.h"
#include "core/names/initial_cells.h"
#include "core/names/mesh_cells.h"
#include "server/attribute_gates.h"
#include "server/block_host.h"

namespace ndmap::server {

// A surface and what all blocks on this server use of it.
struct BlockHost::HostedSurface {
  std::shared_ptr<const TriangleSurface> surface;
  std::shared_ptr<ParityCache> parity = std::make_shared<ParityCache>();
  // Higher for one that was put later.
  uint64_t order = 0;
};

struct BlockHost::HostedBlock {
  // Touched only by its actor's tasks and algorithm. The actor owns it too: its last slice may be the last
  // that knows of the block.
  std::shared_ptr<Block3> block;
  // The block's part of the surface, indexed, from one phase to the next.
  std::shared_ptr<IndexCache> index_cache = std::make_shared<IndexCache>();
  // As the block: only its turns touch it.
  std::shared_ptr<AttributeStore> attributes = std::make_shared<AttributeStore>();
  std::shared_ptr<BlockActor> actor;
  // What it was made from, in a map that was made from a mesh.
  std::shared_ptr<const MeshCells> mesh;
};

struct BlockHost::HostedMap {
  std::string name;
  // Of those that ever had the name.
  uint64_t number = 0;
  uint32_t block_count = 0;
  Routing routing = Routing::kDirect;
  // Null when the map was made without.
  std::shared_ptr<const HostedSurface> surface;
  std::optional<GridShape> grid;
  std::shared_ptr<const GridCells> grid_cells;
  // Initial cells of the whole map, when it was made from a mesh.
  std::optional<uint64_t> mesh_cells;
  std::shared_ptr<AttributeGates> gates = std::make_shared<AttributeGates>();
  // Does not change after the map was made.
  std::map<uint32_t, std::shared_ptr<HostedBlock>> blocks;

  absl::Mutex mutex;
  // No phase begins any more; and: nobody has to do anything for it any more.
  bool dropped ABSL_GUARDED_BY(mutex) = false;
  bool gone ABSL_GUARDED_BY(mutex) = false;
  bool in_phase ABSL_GUARDED_BY(mutex) = false;
  // The phase was cancelled; a block whose start comes later is told then.
  bool cancelled ABSL_GUARDED_BY(mutex) = false;
  // The phase brings the attributes up to date.
  bool attributes_phase ABSL_GUARDED_BY(mutex) = false;
  PhaseId phase ABSL_GUARDED_BY(mutex);
  // The phase changes the map; and the last that did.
  bool changing ABSL_GUARDED_BY(mutex) = false;
  PhaseId last_change ABSL_GUARDED_BY(mutex);
  std::vector<std::string> addresses ABSL_GUARDED_BY(mutex);
  // Raised whenever a block comes to rest; wakes PollPhase.
  uint64_t rests ABSL_GUARDED_BY(mutex) = 0;
};

}  // namespace ndmap::server
