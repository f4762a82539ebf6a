// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/vtu_writer.h"

#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <utility>

#include "absl/cleanup/cleanup.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_replace.h"

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
    if (piece.types[c] == kVtkHexahedron) {
      if (end - begin != 8)
        return CellError(c, absl::StrCat("is a hexahedron with ", end - begin, " points"));
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
          c, absl::StrCat("is of VTK type ", piece.types[c], ", not hexahedron (12) or polyhedron (42)"));
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
    absl::StrAppend(&xml_, "<DataArray type=\"", array.type, "\" Name=\"", array.name, "\"", array.more,
                    " format=\"appended\" offset=\"", offset_, "\"/>\n");
    encoded_.emplace_back();
    status_ =
        Compress({reinterpret_cast<const char*>(data.data()), data.size() * sizeof(T)}, &encoded_.back());
    offset_ += encoded_.back().size();
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
  encoder.Xml(absl::StrCat("</PointData>\n<CellData", arrays.id ? kGlobalIds : "", ">\n"));
  if (arrays.block) encoder.Add(kBlock, piece.block);
  if (arrays.level) encoder.Add(kLevel, piece.level);
  if (arrays.state) encoder.Add(kState, piece.state);
  if (arrays.id) encoder.Add(kId, piece.cell_ids);
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
  std::string xml =
      "<?xml version=\"1.0\"?>\n<VTKFile type=\"PUnstructuredGrid\" version=\"1.0\" "
      "byte_order=\"LittleEndian\" "
      "header_type=\"UInt64\" compressor=\"vtkZLibDataCompressor\">\n<PUnstructuredGrid GhostLevel=\"0\">\n";
  const auto declare = [&xml](const Declaration& array) {
    absl::StrAppend(&xml, "<PDataArray type=\"", array.type, "\" Name=\"", array.name, "\"", array.more,
                    "/>\n");
  };
  absl::StrAppend(&xml, "<PPointData", arrays.point_id ? kGlobalIds : "", ">\n");
  if (arrays.point_id) declare(kId);
  absl::StrAppend(&xml, "</PPointData>\n<PCellData", arrays.id ? kGlobalIds : "", ">\n");
  if (arrays.block) declare(kBlock);
  if (arrays.level) declare(kLevel);
  if (arrays.state) declare(kState);
  if (arrays.id) declare(kId);
  absl::StrAppend(&xml, "</PCellData>\n<PPoints>\n");
  declare(kPoints);
  absl::StrAppend(&xml, "</PPoints>\n");
  for (const std::string& name : piece_names) {
    const std::string escaped =
        absl::StrReplaceAll(name, {{"&", "&amp;"}, {"<", "&lt;"}, {">", "&gt;"}, {"\"", "&quot;"}});
    absl::StrAppend(&xml, "<Piece Source=\"", escaped, "\"/>\n");
  }
  absl::StrAppend(&xml, "</PUnstructuredGrid>\n</VTKFile>\n");
  return xml;
}

absl::Status WritePvtuFile(absl::Span<const std::string> piece_names, const std::string& path,
                           const VtuArrays& arrays) {
  return WriteWhole(path, [&](ByteSink sink) { return sink(PvtuText(piece_names, arrays)); });
}

}  // namespace ndmap
