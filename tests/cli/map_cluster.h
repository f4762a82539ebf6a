// SPDX-License-Identifier: GPL-3.0-or-later
// A cluster of two processes with the map "m" in two blocks: an unrefined grid of 6 x 6 x 3 hexahedra.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "tests/cli/command.h"

namespace ndmap::testing {

class MapCluster {
 public:
  MapCluster() : up_({"up", "--processes", "2", "--json"}) {
    EXPECT_TRUE(up_.WaitFor("use it with --coordinator"));
    EXPECT_TRUE(up_.WaitFor("\n}\n"));
    coordinator_ = CoordinatorOf(up_);
    EXPECT_EQ(Ndmap({"sample", "torus", "-o", folder_ / "torus.off", "--triangles", "2000"}).code, 0);
    Create("m");
  }

  const std::string& coordinator() const { return coordinator_; }
  std::string surface() const { return folder_ / "torus.off"; }
  std::vector<std::string> With(std::vector<std::string> arguments) const {
    arguments.insert(arguments.end(), {"--coordinator", coordinator_});
    return arguments;
  }
  Outcome Call(std::vector<std::string> arguments) const { return Ndmap(With(std::move(arguments))); }
  // Must end with this code; its object.
  nlohmann::json Do(std::vector<std::string> arguments, int code = 0) const {
    arguments.push_back("--json");
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, code) << arguments[0] << ": " << outcome.err;
    const nlohmann::json object = outcome.json();
    EXPECT_TRUE(object.is_object()) << outcome.out;
    return object;
  }
  // Must not work; its one line.
  std::string Fails(std::vector<std::string> arguments) const {
    const Outcome outcome = Call(arguments);
    EXPECT_EQ(outcome.code, 1) << arguments[0];
    EXPECT_EQ(outcome.error_lines(), 1) << outcome.err;
    EXPECT_EQ(outcome.out, "");
    return outcome.err;
  }
  void Create(const std::string& map) const {
    Do({"create", map, surface(), "--grid", "6x6x3", "--blocks", "2"});
  }

 private:
  TemporaryFolder folder_;
  Command up_;
  std::string coordinator_;
};

}  // namespace ndmap::testing
