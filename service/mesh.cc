// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/mesh.h"

#include <array>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "service/columns.h"
#include "service/names.h"
#include "service/surface_transfer.h"

namespace ndmap::service {
namespace {

static_assert(sizeof(Point3) == 24 && sizeof(CellKind) == 1, "columns are copied as they lie");

// Far above what fits in memory, so that sums and products cannot overflow.
constexpr uint64_t kMost = uint64_t{1} << 40;

// The bytes of a piece's columns, in their order.
struct Columns {
  explicit Columns(const v1::VolumePiece& piece)
      : bytes{piece.points() * sizeof(Point3), piece.cells() * sizeof(CellKind),
              piece.corners() * sizeof(uint32_t), piece.cells() * sizeof(uint64_t),
              piece.cells() * sizeof(uint32_t)} {}
  uint64_t all() const { return bytes[0] + bytes[1] + bytes[2] + bytes[3] + bytes[4]; }

  std::array<uint64_t, 5> bytes;
};

template <class T>
absl::string_view BytesOf(const std::vector<T>& column) {
  return {reinterpret_cast<const char*>(column.data()), column.size() * sizeof(T)};
}

}  // namespace

uint64_t CellsOf(const v1::MeshSummary& mesh) {
  return mesh.tetrahedra() + mesh.pyramids() + mesh.prisms() + mesh.hexahedra();
}

absl::Status CheckMesh(const v1::MeshSummary& mesh, uint32_t block_count) {
  if (mesh.name().size() > 256) return absl::InvalidArgumentError("a mesh's name has at most 256 bytes");
  const uint64_t most = CellId::kMaxInitial + 1;
  for (uint64_t cells : {mesh.tetrahedra(), mesh.pyramids(), mesh.prisms(), mesh.hexahedra()}) {
    if (cells <= most) continue;
    return absl::InvalidArgumentError(
        absl::StrCat("a mesh of ", cells, " cells of one kind; at most ", most, " cells can be numbered"));
  }
  const uint64_t cells = CellsOf(mesh);
  if (cells == 0 || cells > most) {
    return absl::InvalidArgumentError(
        absl::StrCat("a mesh of ", cells, " cells; 1 to ", most, " are allowed"));
  }
  if (block_count <= cells) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat(block_count, " blocks of a mesh of ", cells, " cells; a block needs at least one"));
}

void SendPiece(const MeshPiece& piece, uint64_t upload, BlockId block, uint32_t block_count,
               absl::FunctionRef<bool(const v1::PieceChunk&)> write) {
  const absl::string_view columns[] = {BytesOf(piece.mesh.points), BytesOf(piece.mesh.kinds),
                                       BytesOf(piece.mesh.corners), BytesOf(piece.numbers),
                                       BytesOf(piece.blocks)};
  std::unique_ptr<XXH3_state_t, decltype(&XXH3_freeState)> hash(XXH3_createState(), &XXH3_freeState);
  XXH3_64bits_reset(hash.get());
  for (absl::string_view column : columns) XXH3_64bits_update(hash.get(), column.data(), column.size());
  v1::PieceChunk chunk;
  v1::PieceHeader& header = *chunk.mutable_header();
  header.set_upload(upload);
  header.set_block(block.value);
  header.set_block_count(block_count);
  header.set_checksum(XXH3_64bits_digest(hash.get()));
  header.mutable_volume()->set_points(piece.mesh.points.size());
  header.mutable_volume()->set_cells(piece.mesh.cells());
  header.mutable_volume()->set_corners(piece.mesh.corners.size());
  if (!write(chunk)) return;
  for (absl::string_view column : columns) {
    for (size_t at = 0; at < column.size(); at += kChunkBytes) {
      chunk.set_data(std::string(column.substr(at, kChunkBytes)));
      if (!write(chunk)) return;
    }
  }
}

PieceReceiver::PieceReceiver(Room room) : room_(std::move(room)), hash_(XXH3_createState(), &XXH3_freeState) {
  XXH3_64bits_reset(hash_.get());
}

absl::Status PieceReceiver::Begin(const v1::PieceHeader& header) {
  if (!header.has_volume()) {
    return absl::InvalidArgumentError("a piece of a mesh of a kind that this server does not know");
  }
  if (header.block_count() < 1 || header.block_count() > kMaxBlocks ||
      header.block() >= header.block_count()) {
    return absl::InvalidArgumentError(absl::StrCat("the piece of block ", header.block(), " of ",
                                                   header.block_count(), " blocks; 1 to ", kMaxBlocks,
                                                   " are allowed, numbered from 0"));
  }
  const v1::VolumePiece& volume = header.volume();
  if (volume.points() > kMost || volume.cells() > kMost || volume.corners() > kMost) {
    return absl::InvalidArgumentError(absl::StrCat("a piece of a mesh of ", volume.points(), " points, ",
                                                   volume.cells(), " cells and ", volume.corners(),
                                                   " corners: nobody has so many"));
  }
  header_ = header;
  has_header_ = true;
  expected_ = Columns(volume).all();
  return absl::OkStatus();
}

absl::Status PieceReceiver::Add(const v1::PieceChunk& chunk) {
  if (!has_header_) {
    if (!chunk.has_header()) return absl::InvalidArgumentError("a piece of a mesh begins with its header");
    return Begin(chunk.header());
  }
  if (!chunk.has_data()) return absl::InvalidArgumentError("after the header of a piece comes its data");
  const absl::string_view data = chunk.data();
  if (data.size() > expected_ - received_) {
    return absl::InvalidArgumentError(
        absl::StrCat("a piece of ", expected_, " bytes by its header has more than that"));
  }
  if (absl::Status status = room_(data.size()); !status.ok()) return status;
  const Columns columns(header_.volume());
  uint64_t begin = 0;
  const auto copy = [&](auto& column, size_t i) {
    CopyInto(column, begin, columns.bytes[i], received_, data);
    begin += columns.bytes[i];
  };
  copy(piece_.mesh.points, 0);
  copy(piece_.mesh.kinds, 1);
  copy(piece_.mesh.corners, 2);
  copy(piece_.numbers, 3);
  copy(piece_.blocks, 4);
  XXH3_64bits_update(hash_.get(), data.data(), data.size());
  received_ += data.size();
  return absl::OkStatus();
}

absl::Status PieceReceiver::Finish() {
  if (!has_header_) return absl::InvalidArgumentError("a piece of a mesh without a header");
  if (received_ != expected_) {
    return absl::InvalidArgumentError(
        absl::StrCat("a piece of ", expected_, " bytes by its header ended after ", received_));
  }
  if (XXH3_64bits_digest(hash_.get()) != header_.checksum()) {
    return absl::DataLossError(absl::StrCat("the piece of block ", header_.block(),
                                            " arrived with another checksum than its header says"));
  }
  VolumeMesh& mesh = piece_.mesh;
  mesh.begins.reserve(mesh.kinds.size() + 1);
  for (CellKind kind : mesh.kinds) {
    if (static_cast<unsigned>(kind) >= kCellKinds) {
      return absl::InvalidArgumentError(
          absl::StrCat("a cell of kind ", static_cast<unsigned>(kind), "; kinds are 0 to ", kCellKinds - 1));
    }
    mesh.begins.push_back(mesh.begins.back() + ShapeOf(kind).corners);
  }
  if (mesh.begins.back() == mesh.corners.size()) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat("the cells of a piece have ", mesh.begins.back(),
                                                 " corners by their kinds, ", mesh.corners.size(), " came"));
}

}  // namespace ndmap::service
