// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/piece_store.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace ndmap::server {

struct PieceStore::Bytes {
  explicit Bytes(uint64_t max) : most(max) {}

  const uint64_t most;
  absl::Mutex mutex;
  uint64_t kept ABSL_GUARDED_BY(mutex) = 0;
};

PieceStore::PieceStore(uint64_t max_bytes, absl::Duration patience)
    : patience_(patience), bytes_(std::make_shared<Bytes>(max_bytes)) {}

PieceStore::Room::~Room() {
  absl::MutexLock lock(&bytes_->mutex);
  bytes_->kept -= taken_;
}

absl::Status PieceStore::Room::Take(uint64_t bytes) {
  absl::MutexLock lock(&bytes_->mutex);
  if (bytes > bytes_->most - bytes_->kept) {
    return absl::ResourceExhaustedError(absl::StrCat("the server would keep ", bytes_->kept + bytes,
                                                     " bytes of pieces of meshes, over its limit of ",
                                                     bytes_->most, " (--max-piece-bytes)"));
  }
  bytes_->kept += bytes;
  taken_ += bytes;
  return absl::OkStatus();
}

uint64_t PieceStore::bytes() const {
  absl::MutexLock lock(&bytes_->mutex);
  return bytes_->kept;
}

void PieceStore::Touch(uint64_t upload, absl::Time now) {
  absl::MutexLock lock(&mutex_);
  if (auto it = uploads_.find(upload); it != uploads_.end()) it->second.touched = now;
}

void PieceStore::Put(uint64_t upload, uint32_t block_count, std::shared_ptr<const MeshCells> cells,
                     std::shared_ptr<Room> room, absl::Time now) {
  struct Held {
    std::shared_ptr<const MeshCells> cells;
    std::shared_ptr<Room> room;
  };
  const uint32_t block = cells->self().value;
  auto held = std::make_shared<const Held>(Held{std::move(cells), std::move(room)});
  // A piece that is replaced goes when the lock is free again: that takes a while.
  std::shared_ptr<const MeshCells> replaced(held, held->cells.get());
  absl::MutexLock lock(&mutex_);
  Upload& of = uploads_[upload];
  of.touched = now;
  Piece& piece = of.pieces[block];
  piece.block_count = block_count;
  piece.cells.swap(replaced);
}

absl::StatusOr<std::vector<std::shared_ptr<const MeshCells>>> PieceStore::Claim(
    uint64_t upload, const std::vector<uint32_t>& blocks, uint32_t block_count, uint64_t cells) {
  std::vector<std::shared_ptr<const MeshCells>> claimed;
  Upload rest;
  absl::MutexLock lock(&mutex_);
  const auto of = uploads_.find(upload);
  for (uint32_t b : blocks) {
    const Piece* piece = nullptr;
    if (of != uploads_.end()) {
      if (const auto it = of->second.pieces.find(b); it != of->second.pieces.end()) piece = &it->second;
    }
    if (piece == nullptr) {
      return absl::NotFoundError(absl::StrCat("the piece of the mesh for block ", b,
                                              " is not here (any more): send the pieces again"));
    }
    const uint64_t last = piece->cells->piece().numbers.back();
    if (piece->block_count != block_count || last >= cells) {
      return absl::InvalidArgumentError(absl::StrCat(
          "the piece for block ", b, " is of a mesh of ", piece->block_count, " blocks with cell ", last,
          ", the map of one of ", block_count, " blocks and ", cells, " cells"));
    }
    claimed.push_back(piece->cells);
  }
  if (of != uploads_.end()) {
    rest = std::move(of->second);
    uploads_.erase(of);
  }
  return claimed;
}

void PieceStore::Drop(uint64_t upload) {
  // Freed when the lock is free again.
  Upload dropped;
  absl::MutexLock lock(&mutex_);
  const auto it = uploads_.find(upload);
  if (it == uploads_.end()) return;
  dropped = std::move(it->second);
  uploads_.erase(it);
}

void PieceStore::DropOld(absl::Time now) {
  std::vector<Upload> dropped;
  absl::MutexLock lock(&mutex_);
  for (auto it = uploads_.begin(); it != uploads_.end();) {
    if (now - it->second.touched < patience_) {
      ++it;
      continue;
    }
    dropped.push_back(std::move(it->second));
    it = uploads_.erase(it);
  }
}

void PieceStore::DropAll() {
  std::map<uint64_t, Upload> dropped;
  absl::MutexLock lock(&mutex_);
  dropped.swap(uploads_);
}

}  // namespace ndmap::server
