// SPDX-License-Identifier: GPL-3.0-or-later
// Runs random cases of the central property: ndmap_property [--seed N | --from A --to B] [--storage
// flat|cgal|both].
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <string>

#include "absl/strings/numbers.h"
#include "tests/property/property_case.h"

int main(int argc, char** argv) {
  uint64_t from = 0, to = 200;
  std::string storage = "both";
  for (int i = 1; i < argc; i += 2) {
    const std::string flag = argv[i];
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    bool good = true;
    if (flag == "--seed") {
      good = absl::SimpleAtoi(value, &from);
      to = from + 1;
    } else if (flag == "--from") {
      good = absl::SimpleAtoi(value, &from);
    } else if (flag == "--to") {
      good = absl::SimpleAtoi(value, &to);
    } else if (flag == "--storage") {
      storage = value;
      good = value == "flat" || value == "cgal" || value == "both";
    } else {
      good = false;
    }
    if (!good) {
      std::cerr << "usage: ndmap_property [--seed N | --from A --to B] [--storage flat|cgal|both]\n";
      return 2;
    }
  }
  int failed = 0;
  for (uint64_t seed = from; seed < to; ++seed) {
    for (auto kind : {ndmap::StorageKind::kFlat, ndmap::StorageKind::kCgal}) {
      if (storage != "both" && (storage == "flat") != (kind == ndmap::StorageKind::kFlat)) continue;
      const absl::Status status = ndmap::RunPropertyCase(seed, kind);
      if (status.ok()) continue;
      ++failed;
      std::cout << status << std::endl;
    }
  }
  std::cout << to - from << " cases on storage " << storage << ", seeds " << from << " to " << to - 1 << ": "
            << failed << " failed" << std::endl;
  return failed == 0 ? 0 : 1;
}
