// SPDX-License-Identifier: GPL-3.0-or-later
// For tests of the surface reader: a tetrahedron in every format, and files in a folder of the test's own.
#pragma once

#include <array>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "core/io/surface_reader.h"
#include "gmock/gmock.h"
#include "gtest/gtest.h"

namespace ndmap {

// A tetrahedron in every format.
inline constexpr char kOff[] = "OFF\n4 4 6\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n";
inline constexpr char kObj[] =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1/1 2/2 4/3\nf 2//1\t3//1 4//1\nf -4 -1 -2\n";
inline constexpr char kPlyHeader[] =
    "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty uchar red\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n";
inline const std::array<Point3, 4> kCorners = {Point3{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
inline const std::array<std::array<uint32_t, 3>, 4> kFaces = {
    std::array<uint32_t, 3>{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}};

inline std::string PlyText() {
  return absl::StrCat("ply\nformat ascii 1.0\ncomment end_header\n", kPlyHeader,
                      "0 0 0 9\n1 0 0 9\n0 1 0 9\n0 0 1 9\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n");
}

template <class T>
void Append(T value, bool swap, std::string* out) {
  std::string raw(reinterpret_cast<const char*>(&value), sizeof(value));
  if (swap) raw = std::string(raw.rbegin(), raw.rend());
  *out += raw;
}

inline std::string PlyBinary(bool big) {
  std::string out = absl::StrCat("ply\nformat binary_", big ? "big" : "little", "_endian 1.0\n", kPlyHeader);
  for (const Point3& p : kCorners) {
    for (double x : p) Append(static_cast<float>(x), big, &out);
    out += '\x09';
  }
  for (const auto& f : kFaces) {
    out += '\x03';
    for (uint32_t corner : f) Append(corner, big, &out);
  }
  return out;
}

inline std::string StlText() {
  std::string out = "solid facet vertex\n";
  for (const auto& f : kFaces) {
    out += " facet normal 0 0 1\n  outer loop\n";
    for (uint32_t c : f)
      absl::StrAppend(&out, "   vertex ", kCorners[c][0], " ", kCorners[c][1], " ", kCorners[c][2], "\n");
    out += "  endloop\n endfacet\n";
  }
  return out + "endsolid facet vertex\n";
}

inline std::string StlBinary() {
  std::string out = "solid but binary all the same";
  out.resize(80, ' ');
  Append(uint32_t{4}, false, &out);
  for (const auto& f : kFaces) {
    out.append(12, '\0');
    for (uint32_t c : f) {
      for (double x : kCorners[c]) Append(static_cast<float>(x), false, &out);
    }
    out.append(2, '\0');
  }
  return out;
}

// A folder of the test's own, gone when it ends.
class SurfaceReaderTest : public ::testing::Test {
 protected:
  SurfaceReaderTest() {
    std::string name = (std::filesystem::temp_directory_path() / "surface_reader_XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~SurfaceReaderTest() override { std::filesystem::remove_all(folder_); }

  std::string Write(const std::string& name, const std::string& content) {
    const std::string path = (folder_ / name).string();
    std::ofstream(path, std::ios::binary) << content;
    return path;
  }

  // The error for this content, without the path that it must begin with.
  std::string Error(const std::string& name, const std::string& content) {
    const std::string path = Write(name, content);
    const auto file = ReadSurface(path);
    EXPECT_FALSE(file.ok()) << name << " was accepted:\n" << content;
    if (file.ok()) return "";
    const std::string message(file.status().message());
    EXPECT_THAT(message, ::testing::StartsWith(path + ": "));
    EXPECT_THAT(message, ::testing::Not(::testing::HasSubstr("\n")));
    return message.substr(std::min(message.size(), path.size() + 2));
  }

  std::filesystem::path folder_;
};

inline std::string With(absl::string_view content, absl::string_view from, absl::string_view to) {
  EXPECT_THAT(std::string(content), ::testing::HasSubstr(std::string(from)));
  return absl::StrReplaceAll(content, {{from, to}});
}

}  // namespace ndmap
