// SPDX-License-Identifier: GPL-3.0-or-later
// A walk on the global map, key by key: one stands on a dart, and each key goes on, back, or asks.
#pragma once

#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "client/sdk/map.h"

namespace ndmap::cli {

class WalkSession {
 public:
  explicit WalkSession(MapHandle map) : map_(std::move(map)) {}

  // Stands on the dart or cell (its canonical dart) that the text names; empty: on some dart of the map. What
  // to say.
  absl::StatusOr<std::string> Start(const std::string& at);
  // What to say of a key, lines with their ends; empty for white space. FAILED_PRECONDITION when the map has
  // changed: darts of an earlier version lead nowhere.
  absl::StatusOr<std::string> Press(char key);
  // 'q' was pressed.
  bool ended() const { return ended_; }

  static const char* Keys();
  // Where the walk stands, its steps from the first to the last, crossings, and what was asked on the way.
  Json ToJson() const;

 private:
  absl::StatusOr<std::string> Apply(uint8_t beta);
  absl::StatusOr<std::string> Back();
  absl::StatusOr<std::string> CellsAround();
  // Goes there: the line that says where that is, and whether it is another block or server.
  absl::StatusOr<std::string> StandOn(const std::string& how, const v1::DartInfo& dart);

  MapHandle map_;
  v1::DartInfo at_;
  // Where the walk stood before each step that was not taken back.
  std::vector<v1::DartInfo> before_;
  bool ended_ = false;
  Json steps_ = Json::array();
  uint32_t block_crossings_ = 0, server_crossings_ = 0;
};

}  // namespace ndmap::cli
