// SPDX-License-Identifier: GPL-3.0-or-later
// Writes volume meshes for ParaView and VTK: one VTU piece for each block, and the PVTU index that opens them
// all.
//
// A piece is plain arrays: whoever has a mesh (a block's map, a test) fills a VtuPiece; this file knows
// neither CGAL nor our map. Points shared by several pieces are written in each of them; their global ids say
// that they are one.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "absl/functional/function_ref.h"
#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"
#include "absl/types/span.h"
#include "core/geometry/surface.h"

namespace ndmap {

inline constexpr uint8_t kVtkTetra = 10;
inline constexpr uint8_t kVtkHexahedron = 12;
inline constexpr uint8_t kVtkWedge = 13;
inline constexpr uint8_t kVtkPyramid = 14;
inline constexpr uint8_t kVtkPolyhedron = 42;

// What is known of one cell, beside its points.
struct VtuCell {
  int32_t block = 0;
  uint8_t level = 0;
  uint8_t state = 0;  // 0 unknown, 1 outside, 2 inside, 3 cut
  int64_t id = 0;     // the same number whichever piece the cell is in, 0 ... number of all cells - 1
};

// A column of values of all points or all cells of a piece.
struct VtuField {
  enum class Type : uint8_t { kDoubles, kVectors, kIntegers, kTexts };

  // Other than those of the arrays below, and without a character that XML would have to escape.
  std::string name;
  Type type = Type::kDoubles;
  // The one that belongs to the type; of vectors three numbers each.
  std::vector<double> doubles;
  std::vector<int64_t> integers;
  std::vector<std::string> texts;

  // Values.
  size_t size() const;
};

// One piece, as VTK stores it. Fill it with the Add functions, or the arrays directly.
struct VtuPiece {
  std::vector<Point3> points;
  std::vector<int64_t> point_ids;  // one a point: equal in two pieces if and only if it is the same point

  std::vector<int64_t> connectivity;  // indices into points, cell after cell
  std::vector<int64_t> offsets;       // one a cell: where its part of connectivity ends
  std::vector<uint8_t> types;         // one a cell: those above

  // Both empty without polyhedra. For a polyhedron: number of faces, then for each face the number of its
  // points and the points, seen from outside counter-clockwise. face_offsets has one entry a cell: where its
  // part of faces ends, -1 for other cells.
  std::vector<int64_t> faces;
  std::vector<int64_t> face_offsets;

  std::vector<int32_t> block;  // these four: one a cell
  std::vector<uint8_t> level;
  std::vector<int64_t> cell_ids;
  std::vector<uint8_t> state;

  // Whatever else is known of points and cells.
  std::vector<VtuField> point_fields, cell_fields;

  // The index of the new point.
  int64_t AddPoint(const Point3& point, int64_t id);
  // Corners in VTK's order: 0-3 around the bottom, counter-clockwise seen from the top, 4-7 above them.
  void AddHexahedron(absl::Span<const int64_t> corners, const VtuCell& cell);
  // A cell of any of the types above but the polyhedron, its corners in VTK's order.
  void AddCell(uint8_t type, absl::Span<const int64_t> corners, const VtuCell& cell);
  // `face_sizes` gives the number of points of each face, `face_points` all their points, one face after the
  // other. A neighbour's finer faces and the points that hang on edges are listed like any others. O(n log n)
  // in the points.
  void AddPolyhedron(absl::Span<const int64_t> face_sizes, absl::Span<const int64_t> face_points,
                     const VtuCell& cell);

 private:
  void EndCell(uint8_t type, int64_t face_offset, const VtuCell& cell);
};

// Which arrays are written beside the mesh itself: the same for an index and all its pieces.
struct VtuArrays {
  bool point_id = true;  // point array "id", marked as global ids: filters then join the points of two pieces
  bool block = true;     // cell arrays "block", "level", "state", "id" (marked as global ids)
  bool level = true;
  bool state = true;
  bool id = true;
};

// Takes the file's bytes in order, at most kVtuChunkBytes a call, never none; an error ends the writing.
inline constexpr size_t kVtuChunkBytes = size_t{1} << 20;
using ByteSink = absl::FunctionRef<absl::Status(absl::string_view)>;

// Writes `piece`, which may be empty, as one .vtu file: appended raw data, zlib-compressed blocks. The
// offsets of the arrays stand before the arrays, so all compressed arrays are in memory at once (for
// hexahedra 10 to 25 bytes each), and little else. The same piece gives the same bytes. InvalidArgument,
// before the sink gets anything, if the arrays do not fit together; an array that is not wanted is not looked
// at. O(size of the arrays).
absl::Status WriteVtu(const VtuPiece& piece, ByteSink sink, const VtuArrays& arrays = {});

// As WriteVtu. The file appears at `path` when it is complete; on an error nothing is left behind.
absl::Status WriteVtuFile(const VtuPiece& piece, const std::string& path, const VtuArrays& arrays = {});

// The text of the .pvtu file for these pieces, named relative to its own folder.
std::string PvtuText(absl::Span<const std::string> piece_names, const VtuArrays& arrays = {});

// The same for pieces with the arrays of the one whose beginning this is, up to where the appended data
// begin. INVALID_ARGUMENT if it is no piece that WriteVtu wrote.
absl::StatusOr<std::string> PvtuTextLike(absl::string_view piece, absl::Span<const std::string> piece_names);

// Writes PvtuText to `path`; on an error nothing is left behind.
absl::Status WritePvtuFile(absl::Span<const std::string> piece_names, const std::string& path,
                           const VtuArrays& arrays = {});

// Writes PvtuTextLike, for the piece in this file.
absl::Status WritePvtuFileLike(const std::string& piece_path, absl::Span<const std::string> piece_names,
                               const std::string& path);

}  // namespace ndmap
