// SPDX-License-Identifier: GPL-3.0-or-later
// Goes once around an edge of a map, from hexahedron to hexahedron, wherever their blocks are:
// example_edge_star HOST:PORT MAP. Around an edge one alternates beta 2 (the other face of the same
// hexahedron) and beta 3 (the hexahedron beyond the face).
#include <cstdint>
#include <iostream>
#include <vector>

#include "client/sdk/client.h"

namespace {

absl::Status WalkAround(const ndmap::MapHandle& map) {
  absl::StatusOr<ndmap::v1::DartInfo> start = map.AnyDart(0);
  if (!start.ok()) return start.status();
  ndmap::v1::DartInfo at = *start;
  std::cout << "around an edge of " << at.cell() << " in block " << at.dart().block() << '\n';
  const std::vector<uint8_t> next_hexahedron = {2, 3};
  for (int hexahedra = 1; hexahedra <= 64; ++hexahedra) {
    absl::StatusOr<std::vector<ndmap::Walked>> walked = map.Beta({at.dart()}, next_hexahedron);
    if (!walked.ok()) return walked.status();
    const ndmap::Walked& end = walked->front();
    if (end.free) {
      std::cout << "boundary after " << hexahedra << " hexahedra\n";
      return absl::OkStatus();
    }
    at = end.at;
    if (at.dart().block() == start->dart().block() && at.dart().dart() == start->dart().dart()) {
      std::cout << "back after " << hexahedra << " hexahedra\n";
      return absl::OkStatus();
    }
    std::cout << at.cell() << " in block " << at.dart().block()
              << (end.server_crossings > 0 ? ", on another server\n" : "\n");
  }
  return absl::InternalError("an edge with more than 64 hexahedra");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: example_edge_star HOST:PORT MAP\n";
    return 2;
  }
  absl::StatusOr<ndmap::Client> client = ndmap::Client::Connect(argv[1]);
  absl::StatusOr<ndmap::MapHandle> map =
      client.ok() ? client->OpenMap(argv[2]) : absl::StatusOr<ndmap::MapHandle>(client.status());
  const absl::Status status = map.ok() ? WalkAround(*map) : map.status();
  if (status.ok()) return 0;
  std::cerr << "example_edge_star: " << status.message() << '\n';
  return 1;
}
