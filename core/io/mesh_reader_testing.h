// SPDX-License-Identifier: GPL-3.0-or-later
// For tests of the mesh readers: a mesh in every format that has no compression (for VTU: vtu_testing.h).
#pragma once

#include <algorithm>
#include <cstdint>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "core/mesh/volume_mesh.h"

namespace ndmap {

// Kinds by the numbers of each format.
inline constexpr int kGmshTypes[] = {4, 7, 6, 5};
inline constexpr int kMfemGeometries[] = {4, 7, 6, 5};
inline constexpr const char* kMeditNames[] = {"Tetrahedra", "Pyramids", "Prisms", "Hexahedra"};
inline constexpr int kMeditCodes[] = {8, 49, 9, 10};

template <class T>
void AppendRaw(T value, bool swap, std::string* out) {
  std::string raw(reinterpret_cast<const char*>(&value), sizeof(value));
  if (swap) std::reverse(raw.begin(), raw.end());
  *out += raw;
}

inline std::string PlaceText(const Point3& p) {
  return absl::StrFormat("%.17g %.17g %.17g", p[0], p[1], p[2]);
}

// The corners of a cell, counted from `first`.
inline std::string CornersText(const VolumeMesh& mesh, uint64_t cell, uint64_t first) {
  std::string text;
  for (uint32_t corner : mesh.Corners(cell)) absl::StrAppend(&text, " ", corner + first);
  return text;
}

// Nodes are numbered from 1, elements from 11; a triangle comes first and has number 10.
inline std::string Gmsh2(const VolumeMesh& mesh, bool binary = false, bool swap = false) {
  std::string out = absl::StrCat("$MeshFormat\n2.2 ", binary ? 1 : 0, " 8\n");
  if (binary) AppendRaw(1, swap, &out), out += "\n";
  absl::StrAppend(&out, "$EndMeshFormat\n$PhysicalNames\n1\n3 1 \"a name\"\n$EndPhysicalNames\n$Nodes\n",
                  mesh.points.size(), "\n");
  for (uint32_t p = 0; p < mesh.points.size(); ++p) {
    if (binary) {
      AppendRaw(static_cast<int32_t>(p + 1), swap, &out);
      for (double x : mesh.points[p]) AppendRaw(x, swap, &out);
    } else {
      absl::StrAppend(&out, p + 1, " ", PlaceText(mesh.points[p]), "\n");
    }
  }
  absl::StrAppend(&out, "$EndNodes\n$Elements\n", mesh.cells() + 1, "\n");
  if (binary) {
    for (int32_t n : {2, 1, 2, 10, 7, 7, 1, 2, 3}) AppendRaw(n, swap, &out);
  } else {
    out += "10 2 2 7 7 1 2 3\n";
  }
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    const int type = kGmshTypes[static_cast<int>(mesh.kinds[c])];
    if (binary) {
      for (int32_t n : {type, 1, 2, static_cast<int>(c) + 11, 7, 7}) AppendRaw(n, swap, &out);
      for (uint32_t corner : mesh.Corners(c)) AppendRaw(static_cast<int32_t>(corner + 1), swap, &out);
    } else {
      absl::StrAppend(&out, c + 11, " ", type, " 2 7 7", CornersText(mesh, c, 1), "\n");
    }
  }
  return out + "$EndElements\n";
}

// As Gmsh2, in two blocks of nodes, the second with parameters; nodes have numbers 2, 4, 6, ...
inline std::string Gmsh4(const VolumeMesh& mesh, bool binary = false, bool swap = false) {
  std::string out = absl::StrCat("$MeshFormat\n4.1 ", binary ? 1 : 0, " 8\n");
  const auto ints = [&](std::initializer_list<int32_t> numbers) {
    for (int32_t n : numbers) binary ? AppendRaw(n, swap, &out) : absl::StrAppend(&out, n, " ");
  };
  const auto size = [&](uint64_t n) { binary ? AppendRaw(n, swap, &out) : absl::StrAppend(&out, n, " "); };
  const auto real = [&](double x) {
    binary ? AppendRaw(x, swap, &out) : absl::StrAppend(&out, absl::StrFormat("%.17g ", x));
  };
  if (binary) AppendRaw(1, swap, &out), out += "\n";
  absl::StrAppend(&out, "$EndMeshFormat\n$Nodes\n");
  const uint64_t points = mesh.points.size(), first = points / 2;
  for (uint64_t n : {uint64_t{2}, points, uint64_t{2}, 2 * points}) size(n);
  for (int block = 0; block < 2; ++block) {
    ints({block == 0 ? 3 : 2, 1, block});
    const uint64_t begin = block == 0 ? 0 : first, end = block == 0 ? first : points;
    size(end - begin);
    for (uint64_t p = begin; p < end; ++p) size(2 * p + 2);
    for (uint64_t p = begin; p < end; ++p) {
      for (double x : mesh.points[p]) real(x);
      if (block == 1) real(0.5), real(0.5);
    }
    if (!binary) out += "\n";
  }
  absl::StrAppend(&out, "\n$EndNodes\n$Elements\n");
  for (uint64_t n : {mesh.cells() + 1, mesh.cells() + 1, uint64_t{10}, mesh.cells() + 10}) size(n);
  ints({2, 1, 2});
  for (uint64_t n : {1, 10, 2, 4, 6}) size(n);
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    ints({3, 1, kGmshTypes[static_cast<int>(mesh.kinds[c])]});
    size(1);
    size(c + 11);
    for (uint32_t corner : mesh.Corners(c)) size(2 * corner + 2);
    if (!binary) out += "\n";
  }
  return out + "\n$EndElements\n$NodeData\n1 $0 any thing\n$EndNodeData\n";
}

inline std::string Medit(const VolumeMesh& mesh) {
  std::string out = "MeshVersionFormatted 2 # text\n\nDimension\n3\nVertices\n";
  absl::StrAppend(&out, mesh.points.size(), "\n");
  for (const Point3& p : mesh.points) absl::StrAppend(&out, PlaceText(p), " 0\n");
  out += "RequiredVertices 2\n1\n2\nTriangles 1\n1 2 3 4\n";
  for (int kind = 0; kind < kCellKinds; ++kind) {
    std::string cells;
    int count = 0;
    for (uint64_t c = 0; c < mesh.cells(); ++c) {
      if (static_cast<int>(mesh.kinds[c]) != kind) continue;
      ++count;
      absl::StrAppend(&cells, CornersText(mesh, c, 1), " 7\n");
    }
    if (count > 0) absl::StrAppend(&out, kMeditNames[kind], "\n", count, "\n", cells);
  }
  return out + "End\n";
}

inline std::string MeditBinary(const VolumeMesh& mesh, int version, bool swap) {
  std::string out;
  AppendRaw(int32_t{1}, swap, &out);
  AppendRaw(int32_t{version}, swap, &out);
  const auto integer = [&](int64_t n) {
    version >= 4 ? AppendRaw(n, swap, &out) : AppendRaw(static_cast<int32_t>(n), swap, &out);
  };
  // A keyword with what follows it, `bytes` long.
  const auto keyword = [&](int32_t code, size_t bytes) {
    AppendRaw(code, swap, &out);
    const size_t next = out.size() + (version >= 3 ? 8 : 4) + bytes;
    version >= 3 ? AppendRaw(int64_t(next), swap, &out) : AppendRaw(int32_t(next), swap, &out);
  };
  const size_t i = version >= 4 ? 8 : 4, r = version >= 2 ? 8 : 4;
  keyword(3, 4);
  AppendRaw(int32_t{3}, swap, &out);
  keyword(4, i + mesh.points.size() * (3 * r + i));
  integer(static_cast<int64_t>(mesh.points.size()));
  for (const Point3& p : mesh.points) {
    for (double x : p) version >= 2 ? AppendRaw(x, swap, &out) : AppendRaw(static_cast<float>(x), swap, &out);
    integer(0);
  }
  keyword(15, 2 * i);  // RequiredVertices, which nobody reads.
  integer(1), integer(1);
  for (int kind = 0; kind < kCellKinds; ++kind) {
    const int64_t count = std::count(mesh.kinds.begin(), mesh.kinds.end(), static_cast<CellKind>(kind));
    if (count == 0) continue;
    keyword(kMeditCodes[kind], i + count * i * (kCellShapes[kind].corners + 1));
    integer(count);
    for (uint64_t c = 0; c < mesh.cells(); ++c) {
      if (static_cast<int>(mesh.kinds[c]) != kind) continue;
      for (uint32_t corner : mesh.Corners(c)) integer(corner + 1);
      integer(7);
    }
  }
  keyword(54, 0);
  return out;
}

inline std::string Mfem(const VolumeMesh& mesh) {
  std::string out =
      absl::StrCat("MFEM mesh v1.0\n\n# a comment\n\ndimension\n3\n\nelements\n", mesh.cells(), "\n");
  for (uint64_t c = 0; c < mesh.cells(); ++c) {
    absl::StrAppend(&out, "1 ", kMfemGeometries[static_cast<int>(mesh.kinds[c])], CornersText(mesh, c, 0),
                    "\n");
  }
  absl::StrAppend(&out, "\nboundary\n1\n1 2 0 1 2\n\nvertices\n", mesh.points.size(), "\n3\n");
  for (const Point3& p : mesh.points) absl::StrAppend(&out, PlaceText(p), "\n");
  return out;
}

}  // namespace ndmap
