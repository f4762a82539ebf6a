// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/walk_session.h"

#include <utility>

#include "absl/strings/ascii.h"
#include "absl/strings/str_cat.h"
#include "client/cli/cell_arguments.h"
#include "client/cli/cell_report.h"
#include "client/sdk/explore.h"
#include "core/map/ids.h"

namespace ndmap::cli {
namespace {

// The canonical dart of a cell.
absl::StatusOr<v1::DartRef> DartOf(const MapHandle& map, const std::string& cell) {
  absl::StatusOr<unsigned> dimension = DimensionOf(cell);
  if (!dimension.ok()) return dimension.status();
  v1::ExploreRequest request = CellsAt(CellAnchor(cell), *dimension);
  request.set_give(v1::GIVE_CELL_DETAILS);
  absl::StatusOr<v1::ExploreResponse> answer = map.Explore(request);
  if (!answer.ok()) return answer.status();
  if (answer->cells_size() != 1)
    return absl::NotFoundError(absl::StrCat("map '", map.name(), "' has no cell ", cell));
  return answer->cells(0).dart();
}

// Some dart of the first block that is not empty.
absl::StatusOr<v1::DartInfo> SomeDart(const MapHandle& map) {
  for (uint32_t block = 0; block < map.info().block_count(); ++block) {
    absl::StatusOr<v1::DartInfo> dart = map.AnyDart(block);
    if (dart.ok() || !absl::IsNotFound(dart.status())) return dart;
  }
  return absl::NotFoundError(absl::StrCat("map '", map.name(), "' has no darts"));
}

}  // namespace

const char* WalkSession::Keys() {
  return "keys: 0-3 apply a beta, b goes back, c shows the cells around, q ends\n";
}

absl::StatusOr<std::string> WalkSession::Start(const std::string& at) {
  if (at.empty()) {
    absl::StatusOr<v1::DartInfo> some = SomeDart(map_);
    if (!some.ok()) return some.status();
    at_ = *some;
  } else {
    absl::StatusOr<v1::DartRef> dart;
    if (IsDart(at)) {
      absl::StatusOr<v1::Anchor> anchor = CellOrDartAnchor(map_, at);
      if (!anchor.ok()) return anchor.status();
      dart = anchor->dart();
    } else {
      dart = DartOf(map_, at);
    }
    if (!dart.ok()) return dart.status();
    absl::StatusOr<std::vector<Walked>> walked = map_.Beta({*dart}, {});
    if (!walked.ok()) return walked.status();
    at_ = walked->front().at;
  }
  return StandOn("start ", at_);
}

absl::StatusOr<std::string> WalkSession::StandOn(const std::string& how, const v1::DartInfo& dart) {
  absl::StatusOr<std::string> from = map_.AddressOf(at_.dart().block());
  absl::StatusOr<std::string> to = map_.AddressOf(dart.dart().block());
  if (!from.ok()) return from.status();
  if (!to.ok()) return to.status();
  const bool block = at_.dart().block() != dart.dart().block(), server = *from != *to;
  block_crossings_ += block;
  server_crossings_ += server;
  Json step = DartAsJson(dart);
  step["how"] = std::string(absl::StripAsciiWhitespace(how));
  step["server"] = *to;
  step["crossed_block"] = block;
  step["crossed_server"] = server;
  steps_.push_back(std::move(step));
  at_ = dart;
  std::string text = absl::StrCat(how, " ", DartAsText(dart), ", level ", dart.level(), ", block ",
                                  dart.dart().block(), "\n");
  if (block) {
    absl::StrAppend(&text, "       crossed to block ", dart.dart().block(),
                    server ? absl::StrCat(" on another service, ", *to) : " on the same service", "\n");
  }
  return text;
}

absl::StatusOr<std::string> WalkSession::Apply(uint8_t beta) {
  absl::StatusOr<std::vector<Walked>> walked = map_.Beta({at_.dart()}, {beta});
  if (!walked.ok()) return walked.status();
  const std::string how = absl::StrCat("beta ", int{beta});
  if (walked->front().free) {
    return absl::StrCat(how, " the dart is free, this is the boundary of the map\n");
  }
  const v1::DartInfo before = at_;
  absl::StatusOr<std::string> text = StandOn(how, walked->front().at);
  if (text.ok()) before_.push_back(before);
  return text;
}

absl::StatusOr<std::string> WalkSession::Back() {
  if (before_.empty()) return "back   this is where the walk began\n";
  const v1::DartInfo dart = before_.back();
  before_.pop_back();
  return StandOn("back  ", dart);
}

absl::StatusOr<std::string> WalkSession::CellsAround() {
  std::string text = "cells ";
  Json cells;
  for (uint32_t i = 0; i <= 3; ++i) {
    absl::StatusOr<v1::ExploreResponse> answer = map_.Explore(CellsAt(DartAnchor(at_.dart()), i));
    if (!answer.ok()) return answer.status();
    if (answer->cell_hi_size() != 1 || answer->cell_lo_size() != 1)
      return absl::InternalError(absl::StrCat("the service named no ", CellWord(i, false), " of the dart"));
    const std::string id = CellId::FromWords(answer->cell_hi(0), answer->cell_lo(0)).ToString();
    absl::StrAppend(&text, i > 0 ? ", " : " ", CellWord(i, false), " ", id);
    cells[CellWord(i, false)] = id;
  }
  steps_.back()["cells"] = std::move(cells);
  return text + "\n";
}

absl::StatusOr<std::string> WalkSession::Press(char key) {
  if (key >= '0' && key <= '3') return Apply(static_cast<uint8_t>(key - '0'));
  if (absl::ascii_isspace(static_cast<unsigned char>(key))) return "";
  switch (key) {
    case 'b':
      return Back();
    case 'c':
      return CellsAround();
    case 'q':
      ended_ = true;
      return "";
    default:
      return std::string(Keys());
  }
}

Json WalkSession::ToJson() const {
  return {{"map", map_.name()},
          {"dart", absl::StrCat(at_.dart().block(), ":", at_.dart().dart())},
          {"block_crossings", block_crossings_},
          {"server_crossings", server_crossings_},
          {"steps", steps_}};
}

}  // namespace ndmap::cli
