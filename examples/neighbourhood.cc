// SPDX-License-Identifier: GPL-3.0-or-later
// Tells about the hexahedra that contain a point, their neighbours and one vertex's orbit, wherever all of
// them live: example_neighbourhood HOST:PORT MAP X Y Z.
#include <array>
#include <cstdlib>
#include <iostream>

#include "client/sdk/client.h"
#include "client/sdk/explore.h"

namespace {

using Point = std::array<double, 3>;

// Neighbours across faces (dimension 2) of every hexahedron at the point.
absl::Status TellNeighbours(const ndmap::MapHandle& map, const Point& point) {
  ndmap::v1::ExploreRequest request = ndmap::CellsAt(ndmap::PointAnchor(point), 3);
  absl::StatusOr<ndmap::v1::ExploreResponse> here = map.Explore(request);
  if (!here.ok()) return here.status();
  for (int i = 0; i < here->cell_hi_size(); ++i) {
    ndmap::v1::CellId id;
    id.set_hi(here->cell_hi(i));
    id.set_lo(here->cell_lo(i));
    request = ndmap::AdjacentCells(ndmap::CellAnchor(id), 3, 2);
    request.set_give(ndmap::v1::GIVE_CELL_DETAILS);
    absl::StatusOr<ndmap::v1::ExploreResponse> around = map.Explore(request);
    if (!around.ok()) return around.status();
    std::cout << around->cells_size() << " neighbours across faces:";
    for (const ndmap::v1::CellDetails& cell : around->cells()) std::cout << ' ' << cell.text();
    std::cout << '\n';
  }
  return absl::OkStatus();
}

// The darts of the nearest vertex, part by part as they come.
absl::Status TellOrbit(const ndmap::MapHandle& map, const Point& point) {
  int darts = 0;
  absl::Status status = map.Explore(ndmap::Orbit(ndmap::NearestVertexAnchor(point), 0),
                                    [&](const ndmap::v1::ExploreResponse& part) {
                                      darts += part.darts_size();
                                      return absl::OkStatus();
                                    });
  if (status.ok()) std::cout << darts << " darts at the nearest vertex\n";
  return status;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: example_neighbourhood HOST:PORT MAP X Y Z\n";
    return 2;
  }
  const Point point = {std::atof(argv[3]), std::atof(argv[4]), std::atof(argv[5])};
  absl::StatusOr<ndmap::Client> client = ndmap::Client::Connect(argv[1]);
  absl::StatusOr<ndmap::MapHandle> map =
      client.ok() ? client->OpenMap(argv[2]) : absl::StatusOr<ndmap::MapHandle>(client.status());
  absl::Status status = map.status();
  if (status.ok()) status = TellNeighbours(*map, point);
  if (status.ok()) status = TellOrbit(*map, point);
  if (status.ok()) return 0;
  std::cerr << "example_neighbourhood: " << status.message() << '\n';
  return 1;
}
