// SPDX-License-Identifier: GPL-3.0-or-later
// Attaches a field to the vertices of a map, their distance from the z axis, and sums it up:
// example_field HOST:PORT MAP.
#include <array>
#include <cmath>
#include <iostream>
#include <utility>
#include <vector>

#include "client/sdk/client.h"

namespace {

constexpr char kName[] = "distance_from_axis";

// A value for every vertex, from its point.
absl::StatusOr<std::pair<ndmap::CellIds, std::vector<double>>> Distances(const ndmap::MapHandle& map) {
  std::pair<ndmap::CellIds, std::vector<double>> all;
  ndmap::AttributeReader reader = map.ReadAttributes(0, {"@point"}, ndmap::AllCells());
  for (absl::StatusOr<ndmap::CellValues>& part : reader) {
    if (!part.ok()) return part.status();
    absl::StatusOr<std::vector<std::array<double, 3>>> points = part->columns[0].AsVectors();
    if (!points.ok()) return points.status();
    for (size_t i = 0; i < points->size(); ++i) {
      all.first.Add(part->cells.hi[i], part->cells.lo[i]);
      all.second.push_back(std::hypot((*points)[i][0], (*points)[i][1]));
    }
  }
  return all;
}

absl::Status Run(const ndmap::MapHandle& map) {
  absl::StatusOr<ndmap::JobHandle> job =
      map.DefineAttribute(ndmap::NewAttribute(kName).OnVertices().OfDoubles().Mean());
  if (!job.ok()) return job.status();
  absl::StatusOr<ndmap::v1::Job> done = job->Wait();
  if (!done.ok()) return done.status();
  if (absl::Status s = ndmap::StatusOf(*done); !s.ok()) return s;

  auto distances = Distances(map);
  if (!distances.ok()) return distances.status();
  auto written = map.WriteAttribute(kName, distances->first,
                                    ndmap::AttributeColumn::Doubles(std::move(distances->second)));
  if (!written.ok()) return written.status();
  std::cout << written->written() << " vertices written\n";

  ndmap::v1::AggregateRequest question;
  question.set_name(kName);
  question.set_dimension(0);
  question.set_integral(true);
  absl::StatusOr<std::vector<ndmap::v1::Aggregate>> groups = map.Aggregate(question);
  if (!groups.ok()) return groups.status();
  for (const ndmap::v1::Aggregate& all : *groups) {
    std::cout << "mean distance from the axis " << all.sum(0) / static_cast<double>(all.count())
              << ", integral " << all.integral(0) << '\n';
  }
  return absl::OkStatus();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::cerr << "usage: example_field HOST:PORT MAP\n";
    return 2;
  }
  absl::StatusOr<ndmap::Client> client = ndmap::Client::Connect(argv[1]);
  absl::StatusOr<ndmap::MapHandle> map =
      client.ok() ? client->OpenMap(argv[2]) : absl::StatusOr<ndmap::MapHandle>(client.status());
  const absl::Status status = map.ok() ? Run(*map) : map.status();
  if (status.ok()) return 0;
  std::cerr << "example_field: " << status.message() << '\n';
  return 1;
}
