// SPDX-License-Identifier: GPL-3.0-or-later
// The tutorial (docs/tutorial.md) with the SDK: walks through the blocks of a map to its boundary, attaches a
// field and adds it up: example_tutorial HOST:PORT MAP X Y Z.
#include <array>
#include <cmath>
#include <cstdlib>
#include <iomanip>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

#include "absl/container/flat_hash_set.h"
#include "client/sdk/attributes.h"
#include "client/sdk/client.h"
#include "client/sdk/explore.h"
#include "client/sdk/navigator.h"

namespace {

using Dart = ndmap::Navigator::Dart;
using Point = std::array<double, 3>;

// A dart of the side of its hexahedron that lies farthest along x. Betas 1 and 2 stay within the hexahedron,
// so what they lead to is its sides, one after the other.
absl::StatusOr<Dart> FarSide(ndmap::Navigator& view, Dart start) {
  absl::flat_hash_set<Dart> seen;
  std::vector<Dart> todo = {start};
  Dart farthest = start;
  double most = -std::numeric_limits<double>::infinity();
  while (!todo.empty()) {
    const Dart first = todo.back();
    todo.pop_back();
    double sum = 0;
    int corners = 0;
    for (Dart d = first; seen.insert(d).second; ++corners) {
      absl::StatusOr<Point> point = view.Point(d);
      absl::StatusOr<Dart> beside = view.Beta(d, 2), next = view.Beta(d, 1);
      for (const absl::Status& status : {point.status(), beside.status(), next.status()}) {
        if (!status.ok()) return status;
      }
      sum += (*point)[0];
      todo.push_back(*beside);
      d = *next;
    }
    if (corners > 0 && sum / corners > most) {
      most = sum / corners;
      farthest = first;
    }
  }
  return farthest;
}

// From the hexahedron at the point to the boundary. The view fetches what it comes to; what a walk costs is
// memory.
absl::Status WalkOut(const ndmap::MapHandle& map, const Point& point) {
  ndmap::v1::ExploreRequest request = ndmap::CellsAt(ndmap::PointAnchor(point), 3);
  request.set_give(ndmap::v1::GIVE_CELL_DETAILS);
  absl::StatusOr<ndmap::v1::ExploreResponse> here = map.Explore(request);
  if (!here.ok()) return here.status();
  if (here->cells().empty()) return absl::NotFoundError("no hexahedron contains the point");
  ndmap::Navigator view(map);
  absl::StatusOr<Dart> dart = view.DartOf(here->cells(0).dart());
  int hexahedra = 0;
  for (uint32_t block = Dart::kFree; dart.ok() && !dart->is_free(); ++hexahedra) {
    if (dart->block != block) std::cout << "in block " << (block = dart->block) << '\n';
    absl::StatusOr<Dart> far = FarSide(view, *dart);
    if (!far.ok()) return far.status();
    dart = view.Beta(*far, 3);
  }
  if (!dart.ok()) return dart.status();
  std::cout << "the boundary of the map after " << hexahedra << " hexahedra\n";
  return absl::OkStatus();
}

// 20 degrees, and up to 70 more around (0.9, 0, 0).
double Temperature(const Point& p) {
  const double x = p[0] - 0.9;
  return 20 + 70 * std::exp(-4 * (x * x + p[1] * p[1] + p[2] * p[2]));
}

// A field on the vertices: read where they are, part by part, and write what the temperature is there.
absl::Status Heat(const ndmap::MapHandle& map) {
  absl::StatusOr<ndmap::JobHandle> job =
      map.DefineAttribute(ndmap::NewAttribute("heat").OnVertices().OfDoubles().Mean().Fill(20.0));
  absl::Status status = job.ok() ? job->Wait().status() : job.status();
  if (!status.ok()) return status;
  ndmap::AttributeReader reader = map.ReadAttributes(0, {"@point"}, ndmap::AllCells());
  for (absl::StatusOr<ndmap::CellValues>& part : reader) {
    if (!part.ok()) return part.status();
    absl::StatusOr<std::vector<Point>> points = part->columns[0].AsVectors();
    if (!points.ok()) return points.status();
    std::vector<double> values;
    for (const Point& point : *points) values.push_back(Temperature(point));
    status =
        map.WriteAttribute("heat", part->cells, ndmap::AttributeColumn::Doubles(std::move(values))).status();
    if (!status.ok()) return status;
  }
  return absl::OkStatus();
}

// The blocks add up their own vertices; what comes here is a row a level.
absl::Status AddUp(const ndmap::MapHandle& map) {
  ndmap::v1::AggregateRequest question;
  question.set_dimension(0);
  question.set_name("heat");
  question.set_group_by(ndmap::v1::GROUP_BY_LEVEL);
  absl::StatusOr<std::vector<ndmap::v1::Aggregate>> levels = map.Aggregate(question);
  if (!levels.ok()) return levels.status();
  std::cout << std::fixed << std::setprecision(2);
  for (const ndmap::v1::Aggregate& level : *levels) {
    std::cout << "level " << level.group() << ": " << level.count() << " vertices, " << level.min(0) << " to "
              << level.max(0) << ", mean " << level.sum(0) / static_cast<double>(level.count()) << '\n';
  }
  return absl::OkStatus();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    std::cerr << "usage: example_tutorial HOST:PORT MAP X Y Z\n";
    return 2;
  }
  const Point point = {std::atof(argv[3]), std::atof(argv[4]), std::atof(argv[5])};
  absl::StatusOr<ndmap::Client> client = ndmap::Client::Connect(argv[1]);
  absl::StatusOr<ndmap::MapHandle> map =
      client.ok() ? client->OpenMap(argv[2]) : absl::StatusOr<ndmap::MapHandle>(client.status());
  absl::Status status = map.status();
  if (status.ok()) status = WalkOut(*map, point);
  if (status.ok()) status = Heat(*map);
  if (status.ok()) status = AddUp(*map);
  if (status.ok()) return 0;
  std::cerr << "example_tutorial: " << status.message() << '\n';
  return 1;
}
