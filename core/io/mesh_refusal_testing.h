// SPDX-License-Identifier: GPL-3.0-or-later
// For tests of the mesh readers: what they say of a file that is wrong.
#pragma once

#include <string>

#include "absl/strings/str_replace.h"
#include "core/io/mesh_reader.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {

// "accepted", or the one line that tells what is wrong.
inline std::string Why(const std::string& bytes) {
  const auto file = ReadVolumeMeshFromBytes(bytes);
  if (file.ok()) return "accepted";
  EXPECT_EQ(file.status().code(), absl::StatusCode::kInvalidArgument) << file.status();
  EXPECT_THAT(std::string(file.status().message()), testing::Not(testing::HasSubstr("\n")));
  return std::string(file.status().message());
}

// `from` must be there.
inline std::string Change(const std::string& text, const std::string& from, const std::string& to) {
  EXPECT_THAT(text, testing::HasSubstr(from));
  return absl::StrReplaceAll(text, {{from, to}});
}

}  // namespace ndmap
