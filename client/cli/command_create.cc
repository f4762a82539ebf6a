// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/command_create.h"

#include <memory>
#include <string>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/grid_options.h"
#include "client/cli/job_display.h"
#include "client/cli/map_report.h"
#include "client/cli/mesh_upload.h"

namespace ndmap::cli {
namespace {

struct CreateOptions {
  std::string map, surface, mesh;
  GlueOptions glue;
  GridOptions grid;
  DepthOptions depth;
};

// Deletes a surface that was sent in vain. Another map may use it, and stays as it is.
void ForgetSurface(const Client& client, const std::string& id) {
  if (!id.empty()) client.DeleteSurface(id).IgnoreError();
}

// Waits for the job that makes the map. One that was not made is of no use to anybody.
absl::StatusOr<int> Await(Context& context, const Client& client, const CreateOptions& options,
                          const std::string& surface_id, const absl::StatusOr<JobHandle>& job) {
  if (!job.ok()) {
    ForgetSurface(client, surface_id);
    return job.status();
  }
  absl::StatusOr<v1::Job> ended = WatchJob(context, *job, false);
  if (absl::IsAborted(ended.status()) || absl::IsCancelled(ended.status())) {
    client.DeleteMap(options.map).IgnoreError();
    ForgetSurface(client, surface_id);
  }
  if (!ended.ok()) return ended.status();
  context.Print(JobAsJson(*ended), JobAsText(*ended));
  return 0;
}

absl::StatusOr<int> FromGrid(Context& context, const Client& client, const CreateOptions& options) {
  absl::StatusOr<SurfaceFile> file = ReadSurfaceAndTell(options.surface, context.progress);
  if (!file.ok()) return file.status();
  absl::StatusOr<GridShape> grid = MakeGrid(options.grid, file->surface);
  if (!grid.ok()) return grid.status();
  if (absl::Status s = CheckDepth(*grid, options.depth.depth); !s.ok()) return s;
  WarnAboutSmallComponents(file->surface, *grid, context.progress);
  absl::StatusOr<std::string> id = client.UploadSurface(ViewOf(file->surface, options.surface));
  if (!id.ok()) return id.status();
  const absl::StatusOr<JobHandle> job =
      client.CreateMap(CreateRequest(options.map, *id, *grid, options.grid, options.depth.depth));
  return Await(context, client, options, *id, job);
}

absl::StatusOr<int> FromMesh(Context& context, const Client& client, const CreateOptions& options) {
  // What takes long is not done for a name that is taken.
  const absl::StatusOr<MapHandle> there = client.OpenMap(options.map);
  if (there.ok()) {
    return absl::AlreadyExistsError(absl::StrCat("there is a map \"", options.map, "\" already"));
  }
  if (!absl::IsNotFound(there.status())) return there.status();
  absl::StatusOr<CutMesh> mesh =
      ReadAndCut(options.mesh, options.glue, options.grid.blocks, options.grid.partition, context.progress);
  if (!mesh.ok()) return mesh.status();
  std::string surface_id;
  if (!options.surface.empty()) {
    absl::StatusOr<SurfaceFile> file = ReadSurfaceAndTell(options.surface, context.progress);
    if (!file.ok()) return file.status();
    absl::StatusOr<std::string> id = client.UploadSurface(ViewOf(file->surface, options.surface));
    if (!id.ok()) return id.status();
    surface_id = *std::move(id);
  }
  v1::CreateMapRequest request;
  request.set_map(options.map);
  request.set_surface_id(surface_id);
  request.set_block_count(options.grid.blocks);
  request.set_routing(options.grid.routing == "broadcast" ? v1::ROUTING_BROADCAST : v1::ROUTING_DIRECT);
  request.set_partition(options.grid.partition);
  const absl::StatusOr<JobHandle> job = SendMesh(client, std::move(request), *mesh, context.progress);
  return Await(context, client, options, surface_id, job);
}

void AddMeshOptions(CLI::App* command, const std::shared_ptr<CreateOptions>& options) {
  CLI::Option* mesh = command->add_option(
      "--mesh", options->mesh,
      "instead of a grid: the cells of a volume mesh in VTU, Gmsh 2 or 4.1, Medit or MFEM");
  for (const char* name : {"--grid", "--cubes", "--padding", "--depth"}) {
    mesh->excludes(command->get_option(name));
  }
  command
      ->add_flag("--merge-points", options->glue.merge_equal_points,
                 "of a mesh: make points of equal coordinates one")
      ->needs(mesh);
  command
      ->add_flag("--allow-concave", options->glue.allow_concave,
                 "of a mesh: take cells of positive volume with a corner turned inside out")
      ->needs(mesh);
}

}  // namespace

void AddCreateCommand(CLI::App& app, Action& action) {
  auto options = std::make_shared<CreateOptions>();
  CLI::App* command = AddCommand(app, "create", "make a map: upload a surface and make a grid, or a mesh",
                                 "ndmap create bunny bunny.off --blocks 8 --coordinator 127.0.0.1:7000");
  command->add_option("MAP", options->map, "name of the map")->required();
  command->add_option("SURFACE,--surface", options->surface,
                      "OFF, OBJ, PLY or STL file of a closed surface; with --mesh it may be left out");
  AddGridOptions(command, &options->grid);
  command
      ->add_option("--depth", options->depth.depth, "the depth that refinement will go to: balances blocks")
      ->check(WholeNumber(0, kMaxDepth, "ids of cells hold 29 levels"))
      ->capture_default_str();
  AddMeshOptions(command, options);
  command->callback([&action, options] {
    if (options->surface.empty() && options->mesh.empty()) {
      throw CLI::RequiredError("SURFACE, or --mesh FILE,");
    }
    action = [options](Context& context) -> absl::StatusOr<int> {
      absl::StatusOr<Client> client = context.Connect();
      if (!client.ok()) return client.status();
      return options->mesh.empty() ? FromGrid(context, *client, *options)
                                   : FromMesh(context, *client, *options);
    };
  });
}

}  // namespace ndmap::cli
