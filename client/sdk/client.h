// SPDX-License-Identifier: Apache-2.0
// The way into a cluster:
//
//   absl::StatusOr<ndmap::Client> client = ndmap::Client::Connect("127.0.0.1:7000");
//   absl::StatusOr<ndmap::MapHandle> map = client->OpenMap("bunny");
//   absl::StatusOr<ndmap::JobHandle> job = map->StartJob("refine", phases);
//   absl::StatusOr<ndmap::v1::Job> done = job->Wait();
//
// Every function returns a status or a StatusOr; every call has a deadline (ClientOptions); what may be done
// twice is tried again when a server does not answer. Errors carry the services' own sentences.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "client/sdk/job.h"
#include "client/sdk/map.h"
#include "client/sdk/options.h"
#include "ndmap/v1/coordinator.pb.h"

namespace ndmap {

// A closed triangulated surface that lies in the caller's memory.
struct SurfaceView {
  absl::string_view name;  // For people.
  absl::Span<const std::array<double, 3>> points;
  absl::Span<const std::array<uint32_t, 3>> triangles;
};

// The id that the surface will have in every cluster: 32 hexadecimal digits that follow from its content.
std::string SurfaceId(const SurfaceView& surface);

// One block's part of a mesh in the caller's memory: the columns of VolumePiece (ndmap/v1/mesh.proto), which
// says what they hold. Whoever has a mesh makes the pieces; the library ndmap_core has what it takes
// (core/mesh/mesh_piece.h).
struct PieceView {
  absl::Span<const std::array<double, 3>> points;
  absl::Span<const uint8_t> kinds;
  absl::Span<const uint32_t> corners;
  absl::Span<const uint64_t> numbers;
  absl::Span<const uint32_t> blocks;
};

// A cluster, seen through its coordinator. Cheap to copy; all its functions may be called from any thread.
class Client {
 public:
  // Connects to HOST:PORT and exchanges versions. UNAVAILABLE or DEADLINE_EXCEEDED in one sentence, within
  // options.connect_timeout, if nobody is there; FAILED_PRECONDITION naming both protocols if they differ.
  static absl::StatusOr<Client> Connect(const std::string& target, const ClientOptions& options = {});

  const std::string& target() const;
  // The coordinator's.
  const v1::Version& version() const { return *version_; }

  absl::StatusOr<std::vector<v1::Server>> ListServers() const;
  absl::StatusOr<v1::ProcessStats> CoordinatorStats() const;

  // Sends the surface in chunks of 1 MiB; returns its id. Sending one that is there already is no error.
  // `progress` is told how many bytes of how many have gone.
  absl::StatusOr<std::string> UploadSurface(
      const SurfaceView& surface, const std::function<void(uint64_t, uint64_t)>& progress = nullptr) const;
  absl::Status DeleteSurface(const std::string& surface_id) const;

  // Starts to make a map; the job builds its initial hexahedra.
  absl::StatusOr<JobHandle> CreateMap(const v1::CreateMapRequest& request) const;
  // The same of a mesh: sends the piece of every block to the server where the block will be, then starts the
  // job, which makes the cells. `request` has the map's name, its number of blocks, the summary of the mesh,
  // and maybe a surface; the rest of its `mesh` is filled in here. `piece` gives the piece of a block, which
  // lies there until it is asked for the next one; `progress` is told how many blocks of how many have
  // theirs. When it fails, no piece is left behind.
  absl::StatusOr<JobHandle> CreateMapFromMesh(
      v1::CreateMapRequest request, absl::FunctionRef<absl::StatusOr<PieceView>(uint32_t block)> piece,
      const std::function<void(uint32_t, uint32_t)>& progress = nullptr) const;
  absl::StatusOr<std::vector<v1::Map>> ListMaps() const;
  // A handle with the map's present routing table.
  absl::StatusOr<MapHandle> OpenMap(const std::string& name) const;
  absl::Status DeleteMap(const std::string& name) const;

  // The jobs of one map, or of all maps.
  absl::StatusOr<std::vector<v1::Job>> ListJobs(const std::string& map = "") const;
  // A handle on a job by its number. Asks nobody.
  JobHandle Job(uint64_t job) const { return JobHandle(connection_, job); }

 private:
  Client(std::shared_ptr<internal::Connection> connection, v1::Version version)
      : connection_(std::move(connection)),
        version_(std::make_shared<const v1::Version>(std::move(version))) {}

  std::shared_ptr<internal::Connection> connection_;
  std::shared_ptr<const v1::Version> version_;
};

}  // namespace ndmap
