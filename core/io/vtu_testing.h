// SPDX-License-Identifier: GPL-3.0-or-later
// For tests of the VTU reader: a mesh as a .vtu file in every encoding.
#pragma once

#include <lzma.h>
#include <zlib.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/io/mesh_reader_testing.h"

namespace ndmap {

struct VtuStyle {
  enum Format { kAscii, kBinary, kAppendedRaw, kAppendedBase64 } format = kAscii;
  enum Compressor { kNone, kZlib, kLzma } compressor = kNone;
  bool wide_header = true, big_endian = false, small_types = false;
  bool header_apart = true;  // In base64 without compression: the header padded for itself.
  bool gmsh_prisms = false;  // Prisms listed in Gmsh's order.
};

class VtuText {
 public:
  VtuText(const VolumeMesh& mesh, const VtuStyle& style) : style_(style) {
    constexpr int kTypes[] = {10, 14, 13, 12};
    std::vector<double> points;
    for (const Point3& p : mesh.points) points.insert(points.end(), p.begin(), p.end());
    std::vector<int64_t> connectivity, offsets, types;
    for (uint64_t c = 0; c < mesh.cells(); ++c) {
      const auto corners = mesh.Corners(c);
      const bool wedge = mesh.kinds[c] == CellKind::kPrism && !style.gmsh_prisms;
      const int order[] = {0, wedge ? 2 : 1, wedge ? 1 : 2, 3, wedge ? 5 : 4, wedge ? 4 : 5, 6, 7};
      for (size_t i = 0; i < corners.size(); ++i) connectivity.push_back(corners[order[i]]);
      offsets.push_back(static_cast<int64_t>(connectivity.size()));
      types.push_back(kTypes[static_cast<int>(mesh.kinds[c])]);
    }
    text_ = absl::StrCat(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"",
        style.big_endian ? "Big" : "Little", "Endian\"", style.wide_header ? " header_type=\"UInt64\"" : "",
        style.compressor == VtuStyle::kZlib   ? " compressor=\"vtkZLibDataCompressor\""
        : style.compressor == VtuStyle::kLzma ? " compressor=\"vtkLZMADataCompressor\""
                                              : "",
        ">\n<UnstructuredGrid>\n<Piece NumberOfPoints=\"", mesh.points.size(), "\" NumberOfCells=\"",
        mesh.cells(), "\">\n<PointData>\n");
    Array<float, double>("Float32", "Name=\"heat\"", points);
    absl::StrAppend(&text_, "</PointData>\n<Points>\n");
    style.small_types ? Array<float, double>("Float32", "NumberOfComponents=\"3\"", points)
                      : Array<double, double>("Float64", "NumberOfComponents=\"3\"", points);
    absl::StrAppend(&text_, "</Points>\n<Cells>\n");
    for (const auto& [name, numbers] :
         {std::pair(R"(Name="connectivity")", &connectivity), std::pair(R"(Name="offsets")", &offsets)}) {
      style.small_types ? Array<int32_t, int64_t>("Int32", name, *numbers)
                        : Array<int64_t, int64_t>("Int64", name, *numbers);
    }
    Array<uint8_t, int64_t>("UInt8", "Name=\"types\"", types);
    absl::StrAppend(&text_, "</Cells>\n</Piece>\n</UnstructuredGrid>\n");
    if (style.format == VtuStyle::kAppendedRaw || style.format == VtuStyle::kAppendedBase64) {
      absl::StrAppend(&text_, "<AppendedData encoding=\"",
                      style.format == VtuStyle::kAppendedRaw ? "raw" : "base64", "\">\n  _", appended_,
                      "\n</AppendedData>\n");
    }
    absl::StrAppend(&text_, "</VTKFile>\n");
  }

  const std::string& text() const { return text_; }

 private:
  template <class Stored, class Given>
  void Array(const char* type, const char* attributes, const std::vector<Given>& numbers) {
    absl::StrAppend(&text_, "<DataArray type=\"", type, "\" ", attributes, " format=\"");
    if (style_.format == VtuStyle::kAscii) {
      absl::StrAppend(&text_, "ascii\">\n");
      for (Given n : numbers) absl::StrAppend(&text_, absl::StrFormat("%.17g", static_cast<double>(n)), " ");
      absl::StrAppend(&text_, "\n</DataArray>\n");
      return;
    }
    std::string raw;
    for (Given n : numbers) AppendRaw(static_cast<Stored>(n), style_.big_endian, &raw);
    const auto [header, data] = Packed(raw);
    const bool base64 = style_.format != VtuStyle::kAppendedRaw;
    std::string encoded = header + data;
    if (base64) {
      encoded = style_.header_apart || style_.compressor != VtuStyle::kNone
                    ? absl::StrCat(absl::Base64Escape(header), absl::Base64Escape(data))
                    : absl::Base64Escape(encoded);
    }
    if (style_.format == VtuStyle::kBinary) {
      absl::StrAppend(&text_, "binary\">\n  ", encoded, "\n</DataArray>\n");
    } else {
      absl::StrAppend(&text_, "appended\" offset=\"", appended_.size(), "\"/>\n");
      appended_ += encoded;
    }
  }

  std::string Header(const std::vector<uint64_t>& numbers) const {
    std::string header;
    for (uint64_t n : numbers) {
      style_.wide_header ? AppendRaw(n, style_.big_endian, &header)
                         : AppendRaw(static_cast<uint32_t>(n), style_.big_endian, &header);
    }
    return header;
  }

  // In blocks of 40 bytes, so that there are several.
  std::pair<std::string, std::string> Packed(const std::string& raw) const {
    if (style_.compressor == VtuStyle::kNone) return {Header({raw.size()}), raw};
    constexpr size_t kBlock = 40;
    std::vector<uint64_t> header = {(raw.size() + kBlock - 1) / kBlock, kBlock, raw.size() % kBlock};
    std::string all;
    for (size_t at = 0; at < raw.size(); at += kBlock) {
      const std::string block = raw.substr(at, kBlock);
      std::string packed(1000, '\0');
      size_t size = 0;
      if (style_.compressor == VtuStyle::kZlib) {
        uLongf zlib_size = packed.size();
        compress(reinterpret_cast<Bytef*>(packed.data()), &zlib_size,
                 reinterpret_cast<const Bytef*>(block.data()), block.size());
        size = zlib_size;
      } else {
        lzma_easy_buffer_encode(1, LZMA_CHECK_CRC32, nullptr, reinterpret_cast<const uint8_t*>(block.data()),
                                block.size(), reinterpret_cast<uint8_t*>(packed.data()), &size,
                                packed.size());
      }
      header.push_back(size);
      all.append(packed, 0, size);
    }
    return {Header(header), all};
  }

  VtuStyle style_;
  std::string text_, appended_;
};

inline std::string Vtu(const VolumeMesh& mesh, const VtuStyle& style = {}) {
  return VtuText(mesh, style).text();
}

}  // namespace ndmap
