// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/mesh_upload.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/text.h"
#include "core/algorithm/load/mesh_assignment.h"
#include "core/mesh/mesh_piece.h"

namespace ndmap::cli {
namespace {

v1::MeshSummary Summary(const VolumeMesh& mesh, absl::string_view path) {
  v1::MeshSummary summary;
  path.remove_prefix(path.rfind('/') + 1);
  summary.set_name(std::string(path.substr(0, 256)));
  std::array<uint64_t, kCellKinds> cells{};
  for (CellKind kind : mesh.kinds) ++cells[static_cast<size_t>(kind)];
  summary.set_tetrahedra(cells[static_cast<size_t>(CellKind::kTetrahedron)]);
  summary.set_pyramids(cells[static_cast<size_t>(CellKind::kPyramid)]);
  summary.set_prisms(cells[static_cast<size_t>(CellKind::kPrism)]);
  summary.set_hexahedra(cells[static_cast<size_t>(CellKind::kHexahedron)]);
  summary.set_points(mesh.points.size());
  Point3 lo = mesh.points[0], hi = mesh.points[0];
  for (const Point3& p : mesh.points) {
    for (int c = 0; c < 3; ++c) {
      lo[c] = std::min(lo[c], p[c]);
      hi[c] = std::max(hi[c], p[c]);
    }
  }
  summary.mutable_lo()->Add(lo.begin(), lo.end());
  summary.mutable_hi()->Add(hi.begin(), hi.end());
  return summary;
}

}  // namespace

absl::StatusOr<CutMesh> ReadAndCut(const std::string& path, const GlueOptions& glue, uint32_t blocks,
                                   absl::string_view partition, Progress& progress) {
  progress.Begin("read");
  absl::StatusOr<GluedMesh> glued = ReadGluedMesh(path, glue);
  absl::StatusOr<std::vector<uint32_t>> block_of =
      glued.ok() ? AssignMesh(*glued, blocks, partition)
                 : absl::StatusOr<std::vector<uint32_t>>(glued.status());
  if (!block_of.ok()) {
    progress.Abandon();
    return block_of.status();
  }
  progress.End(absl::StrCat(FormatCount(static_cast<int64_t>(glued->mesh.cells())), " cells, ",
                            FormatCount(static_cast<int64_t>(glued->mesh.points.size())), " points"));
  for (const std::string& note : glued->notes) progress.Note(absl::StrCat("note: ", note));
  for (const std::string& warning : glued->warnings) progress.Note(absl::StrCat("warning: ", warning));
  CutMesh cut;
  cut.mesh = std::move(glued->mesh);
  cut.block_of = *std::move(block_of);
  cut.summary = Summary(cut.mesh, path);
  return cut;
}

absl::StatusOr<JobHandle> SendMesh(const Client& client, v1::CreateMapRequest request, const CutMesh& mesh,
                                   Progress& progress) {
  *request.mutable_mesh()->mutable_mesh() = mesh.summary;
  const uint32_t blocks = request.block_count();
  const MeshCutter cutter(mesh.mesh, mesh.block_of, blocks);
  MeshPiece piece;
  const auto view = [&](uint32_t block) -> absl::StatusOr<PieceView> {
    piece = cutter.Piece(BlockId{block});
    PieceView columns;
    columns.points = piece.mesh.points;
    columns.kinds = {reinterpret_cast<const uint8_t*>(piece.mesh.kinds.data()), piece.mesh.kinds.size()};
    columns.corners = piece.mesh.corners;
    columns.numbers = piece.numbers;
    columns.blocks = piece.blocks;
    return columns;
  };
  progress.Begin("send");
  absl::StatusOr<JobHandle> job =
      client.CreateMapFromMesh(std::move(request), view, [&](uint32_t done, uint32_t all) {
        progress.Update(static_cast<double>(done) / all, absl::StrCat(done, " of ", all, " pieces"));
      });
  if (job.ok()) {
    progress.End(absl::StrCat(blocks, blocks == 1 ? " piece" : " pieces"));
  } else {
    progress.Abandon();
  }
  return job;
}

}  // namespace ndmap::cli
