// SPDX-License-Identifier: GPL-3.0-or-later
// Pieces of meshes on this server: those that wait for the map that is made from them, and how many bytes all
// have together, in maps too. Thread-safe.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"
#include "core/names/mesh_cells.h"

namespace ndmap::server {

class PieceStore {
 private:
  struct Bytes;

 public:
  // `max_bytes` of all pieces, those that arrive, wait and are in maps; what waits is forgotten when nothing
  // more of its upload has come for `patience`.
  PieceStore(uint64_t max_bytes, absl::Duration patience);

  // Room that one piece takes, given back at the end.
  class Room {
   public:
    explicit Room(const PieceStore& store) : bytes_(store.bytes_) {}
    ~Room();
    Room(const Room&) = delete;
    Room& operator=(const Room&) = delete;
    // RESOURCE_EXHAUSTED names the limit.
    absl::Status Take(uint64_t bytes);

   private:
    const std::shared_ptr<Bytes> bytes_;
    uint64_t taken_ = 0;
  };

  // Something of the upload came.
  void Touch(uint64_t upload, absl::Time now);
  // Keeps the piece of a block. One that was there is replaced.
  void Put(uint64_t upload, uint32_t block_count, std::shared_ptr<const MeshCells> cells,
           std::shared_ptr<Room> room, absl::Time now);
  // The pieces of these blocks, which then wait no more; all of them or none. NOT_FOUND names a block whose
  // piece is not here, INVALID_ARGUMENT one that was cut for another number of blocks or has cells beyond
  // those of the mesh.
  absl::StatusOr<std::vector<std::shared_ptr<const MeshCells>>> Claim(uint64_t upload,
                                                                      const std::vector<uint32_t>& blocks,
                                                                      uint32_t block_count, uint64_t cells);
  void Drop(uint64_t upload);
  void DropOld(absl::Time now);
  void DropAll();
  // Of all pieces now.
  uint64_t bytes() const;

 private:
  struct Piece {
    uint32_t block_count = 0;
    // Also holds the room.
    std::shared_ptr<const MeshCells> cells;
  };
  struct Upload {
    absl::Time touched;
    std::map<uint32_t, Piece> pieces;
  };

  const absl::Duration patience_;
  const std::shared_ptr<Bytes> bytes_;
  mutable absl::Mutex mutex_;
  std::map<uint64_t, Upload> uploads_ ABSL_GUARDED_BY(mutex_);
};

}  // namespace ndmap::server
