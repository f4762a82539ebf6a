// SPDX-License-Identifier: GPL-3.0-or-later
// Runs random cases of navigation: ndmap_navigate_cases --n 2|3|4 [--seed N | --from A --to B] [--storage
// flat|cgal].
#include <iostream>
#include <string>

#include "absl/strings/numbers.h"
#include "tests/property/navigate_case.h"

int main(int argc, char** argv) {
  uint64_t from = 0, to = 100;
  uint32_t n = 3;
  std::string storage = "flat";
  for (int i = 1; i < argc; i += 2) {
    const std::string flag = argv[i];
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    bool good = false;
    if (flag == "--seed") {
      good = absl::SimpleAtoi(value, &from);
      to = from + 1;
    } else if (flag == "--from") {
      good = absl::SimpleAtoi(value, &from);
    } else if (flag == "--to") {
      good = absl::SimpleAtoi(value, &to);
    } else if (flag == "--n") {
      good = absl::SimpleAtoi(value, &n) && n >= 2 && n <= 4;
    } else if (flag == "--storage") {
      storage = value;
      good = value == "flat" || value == "cgal";
    }
    if (!good) {
      std::cerr
          << "usage: ndmap_navigate_cases --n 2|3|4 [--seed N | --from A --to B] [--storage flat|cgal]\n";
      return 2;
    }
  }
  const auto kind = storage == "flat" ? ndmap::StorageKind::kFlat : ndmap::StorageKind::kCgal;
  int failed = 0;
  for (uint64_t seed = from; seed < to; ++seed) {
    const absl::Status status = ndmap::RunNavigateCase(n, kind, seed);
    if (status.ok()) continue;
    ++failed;
    std::cout << status << std::endl;
  }
  std::cout << to - from << " cases, n = " << n << ", storage " << storage << ", seeds " << from << " to "
            << to - 1 << ": " << failed << " failed" << std::endl;
  return failed == 0 ? 0 : 1;
}
