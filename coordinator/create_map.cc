// SPDX-License-Identifier: GPL-3.0-or-later
#include "coordinator/create_map.h"

#include <string>

#include "absl/strings/str_cat.h"
#include "core/algorithm/build/assignment.h"
#include "core/algorithm/build/build.h"
#include "core/geometry/grid_shape.h"
#include "service/grid.h"
#include "service/mesh.h"
#include "service/names.h"

namespace ndmap::coordinator {
namespace {

v1::Map MapOf(const v1::CreateMapRequest& request) {
  v1::Map map;
  map.set_map(request.map());
  map.set_block_count(request.block_count());
  map.set_routing(request.routing() == v1::ROUTING_UNSPECIFIED ? v1::ROUTING_DIRECT : request.routing());
  map.set_surface_id(request.surface_id());
  return map;
}

// The servers have the pieces: nothing is left to be told.
absl::StatusOr<std::pair<v1::Map, v1::Phase>> PlanMesh(const v1::CreateMapRequest& request) {
  if (request.has_grid()) {
    return absl::InvalidArgumentError("a map is made from a grid or from a mesh, not from both");
  }
  const v1::MeshSummary& mesh = request.mesh().mesh();
  if (absl::Status status = service::CheckMesh(mesh, request.block_count()); !status.ok()) return status;
  v1::Map map = MapOf(request);
  if (!request.partition().empty()) {
    if (absl::Status s = service::CheckName("partition", request.partition()); !s.ok()) return s;
    map.set_partition(request.partition());
  }
  *map.mutable_mesh() = mesh;
  v1::Phase load;
  load.set_algorithm("load");
  *load.mutable_parameters() = request.parameters();
  return std::make_pair(std::move(map), std::move(load));
}

}  // namespace

absl::StatusOr<std::pair<v1::Map, v1::Phase>> PlanMap(const v1::CreateMapRequest& request,
                                                      const TriangleSurface* surface) {
  if (request.has_mesh()) return PlanMesh(request);
  absl::StatusOr<GridShape> grid = service::GridFromWire(request.grid());
  if (!grid.ok()) return grid.status();
  if (request.depth() > CellId::kMaxLevel)
    return absl::InvalidArgumentError(
        absl::StrCat("a depth of ", request.depth(), " is over ", CellId::kMaxLevel));
  const std::string partition = request.partition().empty() ? "hilbert" : request.partition();
  if (absl::Status status = service::CheckName("partition", partition); !status.ok()) return status;

  v1::Phase build;
  build.set_algorithm("build");
  *build.mutable_parameters() = request.parameters();
  absl::StatusOr<Assignment> assignment =
      request.parameters().contains("assignment")
          ? Assignment::Decode(request.parameters().at("assignment"), grid->CellCount())
          : MakeAssignment(*grid, request.block_count(), partition, surface,
                           static_cast<int>(request.depth()));
  if (!assignment.ok()) return assignment.status();
  const Parameters parameters = GridParameters(*grid, *assignment);
  for (const auto& [name, value] : parameters.values()) (*build.mutable_parameters())[name] = value;

  v1::Map map = MapOf(request);
  *map.mutable_grid() = request.grid();
  map.set_partition(partition);
  return std::make_pair(std::move(map), std::move(build));
}

}  // namespace ndmap::coordinator
