// SPDX-License-Identifier: GPL-3.0-or-later
// Meshes on the wire: the summary of the whole, and pieces as a header and columns of bytes, checked on
// arrival (proto/ndmap/v1/mesh.proto).
#pragma once

#include <xxhash.h>

#include <cstdint>
#include <functional>
#include <memory>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "core/mesh/mesh_piece.h"
#include "ndmap/v1/mesh.pb.h"

namespace ndmap::service {

// INVALID_ARGUMENT unless the name is short, the numbers of cells are those of a mesh whose cells can be
// numbered, and there are at least as many as blocks.
absl::Status CheckMesh(const v1::MeshSummary& mesh, uint32_t block_count);
// Cells of all kinds.
uint64_t CellsOf(const v1::MeshSummary& mesh);

// Header and data of a block's piece, a chunk at a time; stops when `write` returns false.
void SendPiece(const MeshPiece& piece, uint64_t upload, BlockId block, uint32_t block_count,
               absl::FunctionRef<bool(const v1::PieceChunk&)> write);

// Takes the chunks of one piece. Trusts nothing: memory grows with what arrives, not with what a header
// promises.
class PieceReceiver {
 public:
  // `room` is asked for room for so many more bytes, before they are kept.
  using Room = std::function<absl::Status(uint64_t bytes)>;
  explicit PieceReceiver(Room room);

  absl::Status Add(const v1::PieceChunk& chunk);
  // All is there, has the checksum that the header names, and its columns fit together. What they say is for
  // ValidatePiece.
  absl::Status Finish();

  // After the first chunk was added.
  const v1::PieceHeader& header() const { return header_; }
  // After Finish().
  MeshPiece&& Take() { return std::move(piece_); }

 private:
  absl::Status Begin(const v1::PieceHeader& header);

  const Room room_;
  bool has_header_ = false;
  v1::PieceHeader header_;
  uint64_t expected_ = 0, received_ = 0;
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> hash_;
  MeshPiece piece_;
};

}  // namespace ndmap::service
