// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/vtu_writer.h"

#include <zlib.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"
#include "absl/strings/str_split.h"
#include "absl/strings/strip.h"

namespace ndmap {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

// Of uncompressed data; larger blocks compress a little better, smaller ones let readers skip more.
constexpr size_t kBlockBytes = size_t{1} << 18;
constexpr int kFastest = 1;

// How an array is declared in XML, in a piece and (as P...) in an index.
struct Declaration {
  absl::string_view name;
  absl::string_view type;
  absl::string_view more = "";
};
constexpr Declaration kPoints{"Points", "Float64", " NumberOfComponents=\"3\""};
constexpr Declaration kConnectivity{"connectivity", "Int64"};
constexpr Declaration kOffsets{"offsets", "Int64"};
constexpr Declaration kTypes{"types", "UInt8"};
constexpr Declaration kFaces{"faces", "Int64"};
constexpr Declaration kFaceOffsets{"faceoffsets", "Int64"};
// Without IdType VTK's reader makes an array that its filters do not accept as global ids.
constexpr Declaration kId{"id", "Int64", " IdType=\"1\""};
constexpr Declaration kBlock{"block", "Int32"};
constexpr Declaration kLevel{"level", "UInt8"};
constexpr Declaration kState{"state", "UInt8"};

constexpr absl::string_view kGlobalIds = " GlobalIds=\"id\"";
// Before an array's place in the appended data.
constexpr absl::string_view kAppended = " format=\"appended\" offset=\"";
constexpr absl::string_view kAppendedData = "<AppendedData";
// What the head of a piece may be long, names of arrays and all.
constexpr size_t kMostHead = size_t{1} << 20;

absl::Status CheckSize(absl::string_view name, size_t size, size_t wanted, absl::string_view of) {
  if (size == wanted) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("VTU piece: array ", name, " has ", size, " entries for ", wanted, " ", of));
}

absl::Status CheckSizes(const VtuPiece& piece, const VtuArrays& arrays) {
  const size_t cells = piece.types.size();
  absl::Status status = CheckSize("offsets", piece.offsets.size(), cells, "cells");
  if (arrays.point_id)
    status.Update(CheckSize("point_ids", piece.point_ids.size(), piece.points.size(), "points"));
  if (arrays.block) status.Update(CheckSize("block", piece.block.size(), cells, "cells"));
  if (arrays.level) status.Update(CheckSize("level", piece.level.size(), cells, "cells"));
  if (arrays.state) status.Update(CheckSize("state", piece.state.size(), cells, "cells"));
  if (arrays.id) status.Update(CheckSize("cell_ids", piece.cell_ids.size(), cells, "cells"));
  if (!piece.faces.empty() || !piece.face_offsets.empty()) {
    status.Update(CheckSize("face_offsets", piece.face_offsets.size(), cells, "cells"));
  }
  for (const VtuField& field : piece.point_fields) {
    status.Update(CheckSize(field.name, field.size(), piece.points.size(), "points"));
  }
  for (const VtuField& field : piece.cell_fields) {
    status.Update(CheckSize(field.name, field.size(), cells, "cells"));
  }
  return status;
}

absl::Status CellError(size_t cell, absl::string_view what) {
  return absl::InvalidArgumentError(absl::StrCat("VTU piece: cell ", cell, " ", what));
}

// `stream` is one polyhedron's part of the faces.
bool ValidFaces(absl::Span<const int64_t> stream, int64_t points) {
  if (stream.empty() || stream[0] < 4) return false;
  int64_t left = stream[0];
  stream.remove_prefix(1);
  for (; left > 0 && !stream.empty(); --left) {
    const int64_t size = stream[0];
    stream.remove_prefix(1);
    if (size < 3 || static_cast<size_t>(size) > stream.size()) return false;
    for (int64_t p : stream.first(size)) {
      if (p < 0 || p >= points) return false;
    }
    stream.remove_prefix(size);
  }
  return left == 0 && stream.empty();
}

struct LinearCell {
  uint8_t type;
  int64_t points;
  absl::string_view name;
};
const LinearCell* LinearCellOf(uint8_t type) {
  static constexpr LinearCell kLinear[] = {{kVtkTetra, 4, "tetrahedron"},
                                           {kVtkHexahedron, 8, "hexahedron"},
                                           {kVtkWedge, 6, "wedge"},
                                           {kVtkPyramid, 5, "pyramid"}};
  for (const LinearCell& cell : kLinear) {
    if (cell.type == type) return &cell;
  }
  return nullptr;
}

absl::Status CheckCells(const VtuPiece& piece) {
  const int64_t points = static_cast<int64_t>(piece.points.size());
  int64_t begin = 0;
  int64_t faces_begin = 0;
  for (size_t c = 0; c < piece.types.size(); ++c) {
    const int64_t end = piece.offsets[c];
    if (end < begin || end > static_cast<int64_t>(piece.connectivity.size())) {
      return CellError(
          c, absl::StrCat("ends at ", end, " of ", piece.connectivity.size(), " connectivity entries"));
    }
    for (int64_t i = begin; i < end; ++i) {
      const int64_t p = piece.connectivity[i];
      if (p < 0 || p >= points) return CellError(c, absl::StrCat("names point ", p, " of ", points));
    }
    if (const LinearCell* linear = LinearCellOf(piece.types[c]); linear != nullptr) {
      if (end - begin != linear->points)
        return CellError(c, absl::StrCat("is a ", linear->name, " with ", end - begin, " points"));
    } else if (piece.types[c] == kVtkPolyhedron) {
      const int64_t faces_end = piece.face_offsets.empty() ? -1 : piece.face_offsets[c];
      if (faces_end < faces_begin || faces_end > static_cast<int64_t>(piece.faces.size()) ||
          !ValidFaces(absl::MakeConstSpan(piece.faces).subspan(faces_begin, faces_end - faces_begin),
                      points)) {
        return CellError(c, "is a polyhedron whose faces are not a count and as many lists of points");
      }
      faces_begin = faces_end;
    } else {
      return CellError(
          c, absl::StrCat(
                 "is of VTK type ", piece.types[c],
                 ", not tetrahedron (10), hexahedron (12), wedge (13), pyramid (14) or polyhedron (42)"));
    }
    begin = end;
  }
  if (begin != static_cast<int64_t>(piece.connectivity.size())) {
    return absl::InvalidArgumentError(absl::StrCat("VTU piece: cells use ", begin, " of ",
                                                   piece.connectivity.size(), " connectivity entries"));
  }
  return absl::OkStatus();
}

// Collects bytes into chunks of at most kVtuChunkBytes.
class ChunkWriter {
 public:
  explicit ChunkWriter(ByteSink sink) : sink_(sink) {}

  absl::Status Write(absl::string_view bytes) {
    while (!bytes.empty()) {
      const size_t take = std::min(bytes.size(), kVtuChunkBytes - buffer_.size());
      absl::StrAppend(&buffer_, bytes.substr(0, take));
      bytes.remove_prefix(take);
      if (buffer_.size() == kVtuChunkBytes) {
        if (absl::Status status = Flush(); !status.ok()) return status;
      }
    }
    return absl::OkStatus();
  }

  absl::Status Flush() {
    if (buffer_.empty()) return absl::OkStatus();
    absl::Status status = sink_(buffer_);
    buffer_.clear();
    return status;
  }

 private:
  ByteSink sink_;
  std::string buffer_;
};

// VTK's compressed array: number of blocks, size of a block, size of the last one if it is smaller (else 0),
// the compressed sizes (all UInt64), the compressed blocks.
absl::Status Compress(absl::string_view data, std::string* out) {
  std::vector<uint64_t> header = {(data.size() + kBlockBytes - 1) / kBlockBytes, kBlockBytes,
                                  data.size() % kBlockBytes};
  const size_t header_bytes = (header.size() + header[0]) * sizeof(uint64_t);
  out->assign(header_bytes, '\0');
  std::string block(compressBound(kBlockBytes), '\0');
  while (!data.empty()) {
    const absl::string_view part = data.substr(0, kBlockBytes);
    uLongf size = block.size();
    const int result = compress2(reinterpret_cast<Bytef*>(block.data()), &size,
                                 reinterpret_cast<const Bytef*>(part.data()), part.size(), kFastest);
    if (result != Z_OK)
      return absl::ResourceExhaustedError(absl::StrCat("zlib cannot compress: ", zError(result)));
    out->append(block, 0, size);
    header.push_back(size);
    data.remove_prefix(part.size());
  }
  std::copy_n(reinterpret_cast<const char*>(header.data()), header_bytes, out->begin());
  return absl::OkStatus();
}

// The XML before the appended data grows together with the compressed arrays that it gives offsets into.
class PieceEncoder {
 public:
  template <typename T>
  void Add(const Declaration& array, const std::vector<T>& data) {
    if (!status_.ok()) return;
    absl::StrAppend(&xml_, array.type == "String" ? "<Array" : "<DataArray", " type=\"", array.type,
                    "\" Name=\"", array.name, "\"", array.more, kAppended, offset_, "\"/>\n");
    encoded_.emplace_back();
    status_ =
        Compress({reinterpret_cast<const char*>(data.data()), data.size() * sizeof(T)}, &encoded_.back());
    offset_ += encoded_.back().size();
  }

  void Add(const VtuField& field) {
    switch (field.type) {
      case VtuField::Type::kDoubles:
        return Add({field.name, "Float64"}, field.doubles);
      case VtuField::Type::kVectors:
        return Add({field.name, "Float64", " NumberOfComponents=\"3\""}, field.doubles);
      case VtuField::Type::kIntegers:
        return Add({field.name, "Int64"}, field.integers);
      case VtuField::Type::kTexts:
        break;
    }
    // Each text to its first zero byte, if it has one, and a zero byte.
    std::vector<char> bytes;
    for (const std::string& text : field.texts) {
      bytes.insert(bytes.end(), text.c_str(), text.c_str() + std::strlen(text.c_str()) + 1);
    }
    Add({field.name, "String"}, bytes);
  }

  void Xml(absl::string_view text) { absl::StrAppend(&xml_, text); }

  absl::Status WriteTo(ByteSink sink) {
    if (!status_.ok()) return status_;
    ChunkWriter out(sink);
    absl::Status status = out.Write(xml_);
    for (std::string& bytes : encoded_) {
      if (status.ok()) status = out.Write(bytes);
      std::string().swap(bytes);
    }
    if (status.ok()) status = out.Write("\n</AppendedData>\n</VTKFile>\n");
    if (status.ok()) status = out.Flush();
    return status;
  }

 private:
  std::string xml_;
  std::vector<std::string> encoded_;
  size_t offset_ = 0;
  absl::Status status_;
};

// Writes a file beside `path` and moves it there when `write` is done with it.
absl::Status WriteWhole(const std::string& path, absl::FunctionRef<absl::Status(ByteSink)> write) {
  const std::string part = path + ".part";
  std::FILE* file = std::fopen(part.c_str(), "wb");
  if (file == nullptr) return absl::ErrnoToStatus(errno, absl::StrCat("cannot write ", part));
  absl::Cleanup remove = [&part] { std::remove(part.c_str()); };
  absl::Status status = write([&](absl::string_view bytes) {
    if (std::fwrite(bytes.data(), 1, bytes.size(), file) == bytes.size()) return absl::OkStatus();
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot write ", part));
  });
  if (std::fclose(file) != 0) status.Update(absl::ErrnoToStatus(errno, absl::StrCat("cannot write ", part)));
  if (!status.ok()) return status;
  if (std::rename(part.c_str(), path.c_str()) != 0) {
    return absl::ErrnoToStatus(errno, absl::StrCat("cannot write ", path));
  }
  std::move(remove).Cancel();
  return absl::OkStatus();
}

// The index, of what it says of point and cell data.
std::string Index(absl::string_view data, absl::Span<const std::string> piece_names) {
  std::string xml = absl::StrCat(
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<PUnstructuredGrid GhostLevel=\"0\">\n",
      data, "<PPoints>\n<PDataArray type=\"", kPoints.type, "\" Name=\"", kPoints.name, "\"", kPoints.more,
      "/>\n</PPoints>\n");
  for (const std::string& name : piece_names) {
    const std::string escaped =
        absl::StrReplaceAll(name, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}});
    absl::StrAppend(&xml, "<Piece Source=\"", escaped, "\"/>\n");
  }
  absl::StrAppend(&xml, "</PUnstructuredGrid>\n</VTKFile>\n");
  return xml;
}

}  // namespace

absl::Status WriteVtu(const VtuPiece& piece, ByteSink sink, const VtuArrays& arrays) {
  if (absl::Status status = CheckSizes(piece, arrays); !status.ok()) return status;
  if (absl::Status status = CheckCells(piece); !status.ok()) return status;

  PieceEncoder encoder;
  encoder.Xml(
      absl::StrCat("<?xml version=\"1.0\"?>\n<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" "
                   "byte_order=\"LittleEndian\" "
                   "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<UnstructuredGrid>\n<Piece "
                   "NumberOfPoints=\"",
                   piece.points.size(), "\" NumberOfCells=\"", piece.types.size(), "\">\n<PointData",
                   arrays.point_id ? kGlobalIds : "", ">\n"));
  if (arrays.point_id) encoder.Add(kId, piece.point_ids);
  for (const VtuField& field : piece.point_fields) encoder.Add(field);
  encoder.Xml(absl::StrCat("</PointData>\n<CellData", arrays.id ? kGlobalIds : "", ">\n"));
  if (arrays.block) encoder.Add(kBlock, piece.block);
  if (arrays.level) encoder.Add(kLevel, piece.level);
  if (arrays.state) encoder.Add(kState, piece.state);
  if (arrays.id) encoder.Add(kId, piece.cell_ids);
  for (const VtuField& field : piece.cell_fields) encoder.Add(field);
  encoder.Xml("</CellData>\n<Points>\n");
  encoder.Add(kPoints, piece.points);
  encoder.Xml("</Points>\n<Cells>\n");
  encoder.Add(kConnectivity, piece.connectivity);
  encoder.Add(kOffsets, piece.offsets);
  encoder.Add(kTypes, piece.types);
  if (!piece.faces.empty()) {
    encoder.Add(kFaces, piece.faces);
    encoder.Add(kFaceOffsets, piece.face_offsets);
  }
  encoder.Xml("</Cells>\n</Piece>\n</UnstructuredGrid>\n<AppendedData encoding=\"raw\">\n_");
  return encoder.WriteTo(sink);
}

absl::Status WriteVtuFile(const VtuPiece& piece, const std::string& path, const VtuArrays& arrays) {
  return WriteWhole(path, [&](ByteSink sink) { return WriteVtu(piece, sink, arrays); });
}

std::string PvtuText(absl::Span<const std::string> piece_names, const VtuArrays& arrays) {
  std::string point_data, cell_data;
  const auto declare = [](const Declaration& array, std::string& to) {
    absl::StrAppend(&to, "<PDataArray type=\"", array.type, "\" Name=\"", array.name, "\"", array.more,
                    "/>\n");
  };
  if (arrays.point_id) declare(kId, point_data);
  if (arrays.block) declare(kBlock, cell_data);
  if (arrays.level) declare(kLevel, cell_data);
  if (arrays.state) declare(kState, cell_data);
  if (arrays.id) declare(kId, cell_data);
  return Index(
      absl::StrCat("<PPointData", arrays.point_id ? kGlobalIds : "", ">\n", point_data, "</PPointData>\n",
                   "<PCellData", arrays.id ? kGlobalIds : "", ">\n", cell_data, "</PCellData>\n"),
      piece_names);
}

absl::StatusOr<std::string> PvtuTextLike(absl::string_view piece, absl::Span<const std::string> piece_names) {
  std::string data;
  for (absl::string_view section : {"PointData", "CellData"}) {
    const size_t begin = piece.find(absl::StrCat("<", section)),
                 end = piece.find(absl::StrCat("</", section));
    if (begin == absl::string_view::npos || end == absl::string_view::npos || end < begin) {
      return absl::InvalidArgumentError(absl::StrCat("no VTU piece of ours: it has no ", section));
    }
    for (absl::string_view line : absl::StrSplit(piece.substr(begin, end - begin), '\n', absl::SkipEmpty())) {
      if (!absl::ConsumePrefix(&line, "<")) {
        return absl::InvalidArgumentError(
            absl::StrCat("no VTU piece of ours: its ", section, " has more than arrays"));
      }
      // An array ends with its place in the piece, the section itself does not.
      const size_t place = line.find(kAppended);
      absl::StrAppend(&data, "<P", line.substr(0, place), place == absl::string_view::npos ? "\n" : "/>\n");
    }
    absl::StrAppend(&data, "</P", section, ">\n");
  }
  return Index(data, piece_names);
}

absl::Status WritePvtuFile(absl::Span<const std::string> piece_names, const std::string& path,
                           const VtuArrays& arrays) {
  return WriteWhole(path, [&](ByteSink sink) { return sink(PvtuText(piece_names, arrays)); });
}

absl::Status WritePvtuFileLike(const std::string& piece_path, absl::Span<const std::string> piece_names,
                               const std::string& path) {
  std::FILE* file = std::fopen(piece_path.c_str(), "rb");
  if (file == nullptr) return absl::ErrnoToStatus(errno, absl::StrCat("cannot read ", piece_path));
  std::string head;
  size_t end = std::string::npos;
  std::array<char, 4096> part;
  while (end == std::string::npos && head.size() < kMostHead) {
    const size_t read = std::fread(part.data(), 1, part.size(), file);
    if (read == 0) break;
    head.append(part.data(), read);
    end = absl::string_view(head).find(kAppendedData);
  }
  std::fclose(file);
  absl::StatusOr<std::string> text = PvtuTextLike(absl::string_view(head).substr(0, end), piece_names);
  if (!text.ok())
    return absl::Status(text.status().code(), absl::StrCat(piece_path, ": ", text.status().message()));
  return WriteWhole(path, [&](ByteSink sink) { return sink(*text); });
}

}  // namespace ndmap
