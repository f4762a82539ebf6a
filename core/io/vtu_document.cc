// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/vtu_document.h"

#include <expat.h>

#include <algorithm>
#include <exception>
#include <memory>
#include <new>
#include <utility>

#include "absl/functional/function_ref.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/io/text_scanner.h"

namespace ndmap::internal {
namespace {

// The attributes of an element, as Expat gives them: names and values in turn.
absl::string_view Attribute(const char** attributes, absl::string_view name,
                            absl::string_view otherwise = "") {
  for (; attributes[0] != nullptr; attributes += 2) {
    if (attributes[0] == name) return attributes[1];
  }
  return otherwise;
}

class VtuParser {
 public:
  VtuParser(absl::string_view bytes, const VtuWanted& wanted)
      : bytes_(bytes), wanted_(wanted), parser_(XML_ParserCreate(nullptr), XML_ParserFree) {}

  absl::StatusOr<VtuDocument> Parse() {
    if (parser_ == nullptr) return absl::ResourceExhaustedError("no memory to parse XML");
    XML_SetUserData(parser_.get(), this);
    XML_SetElementHandler(parser_.get(), Start, End);
    XML_SetCharacterDataHandler(parser_.get(), Text);
    XML_SetStartDoctypeDeclHandler(parser_.get(), Doctype);
    constexpr size_t kChunk = size_t{16} << 20;
    XML_Status result = XML_STATUS_OK;
    for (size_t at = 0; result == XML_STATUS_OK && !stopped_; at += kChunk) {
      const size_t size = std::min(kChunk, bytes_.size() - at);
      const bool last = at + size == bytes_.size();
      result = XML_Parse(parser_.get(), bytes_.data() + at, static_cast<int>(size), last);
      if (last) break;
    }
    if (out_of_memory_) return absl::ResourceExhaustedError("no memory for the XML of the file");
    if (!status_.ok()) return status_;
    if (!stopped_ && result != XML_STATUS_OK) return XmlError();
    return Finish();
  }

 private:
  static VtuParser* Self(void* self) { return static_cast<VtuParser*>(self); }

  // Expat is C: no exception may pass through it.
  void Guarded(absl::FunctionRef<absl::Status()> handle) {
    if (stopped_) return;
    try {
      status_ = handle();
    } catch (const std::exception&) {
      out_of_memory_ = true;
    }
    if (!status_.ok() || out_of_memory_) Stop();
  }

  static void Start(void* self, const char* name, const char** attributes) {
    Self(self)->Guarded([&] { return Self(self)->OnStart(name, attributes); });
  }
  static void End(void* self, const char* name) {
    Self(self)->Guarded([&] { return Self(self)->OnEnd(name); });
  }
  static void Text(void* self, const char* text, int size) {
    Self(self)->Guarded([&] {
      VtuParser& parser = *Self(self);
      if (parser.array_ != nullptr && parser.within_array_ == 0) {
        parser.array_->text.append(text, static_cast<size_t>(size));
      }
      return absl::OkStatus();
    });
  }
  static void Doctype(void* self, const char*, const char*, const char*, int) {
    Self(self)->Guarded(
        [&] { return Self(self)->Wrong("a document type declaration; VTU files have none"); });
  }

  void Stop() {
    stopped_ = true;
    XML_StopParser(parser_.get(), XML_FALSE);
  }

  uint64_t Line() const { return XML_GetCurrentLineNumber(parser_.get()); }
  absl::Status Wrong(absl::string_view what) const {
    return Invalid(absl::StrCat("line ", Line(), ": ", what));
  }

  absl::Status XmlError() const {
    const XML_Error error = XML_GetErrorCode(parser_.get());
    const bool end = error == XML_ERROR_NO_ELEMENTS || error == XML_ERROR_UNCLOSED_TOKEN ||
                     XML_GetCurrentByteIndex(parser_.get()) >= static_cast<XML_Index>(bytes_.size());
    return Invalid(absl::StrCat(end ? "truncated in line " : "line ", Line(), ": ", XML_ErrorString(error)));
  }

  absl::StatusOr<uint64_t> Number(const char** attributes, absl::string_view name) const {
    const absl::string_view text = Attribute(attributes, name);
    int64_t number = -1;
    if (absl::SimpleAtoi(text, &number) && number >= 0) return static_cast<uint64_t>(number);
    return Wrong(absl::StrCat(Shown(text), " stands where ", name, " should be"));
  }

  absl::Status OnStart(absl::string_view name, const char** attributes) {
    if (!root_) {
      root_ = true;
      return OnRoot(name, attributes);
    }
    // VTK puts keys and values there; what stands in them is no number of the array.
    if (array_ != nullptr) {
      ++within_array_;
      return absl::OkStatus();
    }
    if (name == "Piece") return OnPiece(attributes);
    if (IsSection(name)) section_ = std::string(name);
    if (name == "DataArray" || name == "Array") return OnArray(attributes);
    if (name == "AppendedData") return OnAppended(attributes);
    return absl::OkStatus();
  }

  static bool IsSection(absl::string_view name) {
    return name == "Points" || name == "Cells" || name == "PointData" || name == "CellData";
  }

  absl::Status OnRoot(absl::string_view name, const char** attributes) {
    if (name != "VTKFile") return Wrong(absl::StrCat("begins with ", Shown(name), "; VTKFile expected"));
    const absl::string_view type = Attribute(attributes, "type");
    out_.is_index = type == "PUnstructuredGrid";
    if (out_.is_index && !wanted_.index) {
      return Wrong("is an index of pieces (PUnstructuredGrid); read the .vtu files that it names");
    }
    if (!out_.is_index && type != "UnstructuredGrid") {
      return Wrong(absl::StrCat("is a VTK file of type ", Shown(type), "; UnstructuredGrid expected"));
    }
    out_.big_endian = Attribute(attributes, "byte_order") == "BigEndian";
    out_.wide_header = Attribute(attributes, "header_type") == "UInt64";
    const absl::string_view compressor = Attribute(attributes, "compressor");
    if (compressor == "vtkZLibDataCompressor") {
      out_.compressor = VtuCompressor::kZlib;
    } else if (compressor == "vtkLZMADataCompressor") {
      out_.compressor = VtuCompressor::kLzma;
    } else if (!compressor.empty()) {
      return Wrong(absl::StrCat("is compressed by ", Shown(compressor), "; save it with zlib, LZMA or none"));
    }
    return absl::OkStatus();
  }

  absl::Status OnPiece(const char** attributes) {
    if (out_.is_index) {
      out_.sources.emplace_back(Attribute(attributes, "Source"));
      return absl::OkStatus();
    }
    const auto points = Number(attributes, "NumberOfPoints");
    if (!points.ok()) return points.status();
    const auto cells = Number(attributes, "NumberOfCells");
    if (!cells.ok()) return cells.status();
    section_.clear();
    out_.pieces.push_back({*points, *cells, {}, {}, {}, {}, {}, {}});
    return absl::OkStatus();
  }

  // Where in the piece under way an array belongs; null if nothing is made of it.
  std::optional<VtuArray>* Place(absl::string_view name) {
    if (out_.pieces.empty()) return nullptr;
    VtuFilePiece& piece = out_.pieces.back();
    if (section_ == "Points") return &piece.coordinates;
    if (section_ != "Cells") return nullptr;
    if (name == "connectivity") return &piece.connectivity;
    if (name == "offsets") return &piece.offsets;
    if (name == "types") return &piece.types;
    return nullptr;
  }

  // The same for arrays beside the mesh.
  std::vector<VtuArray>* DataPlace(absl::string_view name) {
    if (std::find(wanted_.data.begin(), wanted_.data.end(), name) == wanted_.data.end()) return nullptr;
    if (out_.pieces.empty()) return nullptr;
    if (section_ == "PointData") return &out_.pieces.back().point_data;
    return section_ == "CellData" ? &out_.pieces.back().cell_data : nullptr;
  }

  absl::Status OnArray(const char** attributes) {
    VtuArray array;
    array.name = section_ == "Points" ? "Points" : std::string(Attribute(attributes, "Name"));
    array.type = std::string(Attribute(attributes, "type"));
    array.format = std::string(Attribute(attributes, "format", "ascii"));
    array.line = Line();
    if (array.format == "appended") {
      const auto offset = Number(attributes, "offset");
      if (!offset.ok()) return offset.status();
      array.offset = *offset;
      out_.all_offsets.push_back(*offset);
    }
    std::vector<VtuArray>* data = DataPlace(array.name);
    std::optional<VtuArray>* place = Place(array.name);
    if (place == nullptr && data == nullptr) return absl::OkStatus();
    if (place != nullptr && place->has_value())
      return Wrong(absl::StrCat("a second array ", Shown(array.name), " in a piece"));
    if (!absl::SimpleAtoi(Attribute(attributes, "NumberOfComponents", "1"), &array.components)) {
      return Wrong("NumberOfComponents is not a number");
    }
    array_ = place != nullptr ? &place->emplace(std::move(array)) : &data->emplace_back(std::move(array));
    return absl::OkStatus();
  }

  absl::Status OnEnd(absl::string_view name) {
    if (within_array_ > 0) {
      --within_array_;
      return absl::OkStatus();
    }
    if (name == "DataArray" || name == "Array") array_ = nullptr;
    if (IsSection(name)) section_.clear();
    return absl::OkStatus();
  }

  // What follows need not be XML any more: the parser's work is done.
  absl::Status OnAppended(const char** attributes) {
    out_.appended_base64 = Attribute(attributes, "encoding", "raw") == "base64";
    const auto tag = static_cast<size_t>(XML_GetCurrentByteIndex(parser_.get())) +
                     static_cast<size_t>(XML_GetCurrentByteCount(parser_.get()));
    const size_t underscore = bytes_.find('_', tag);
    if (underscore == absl::string_view::npos)
      return Wrong("truncated: no underscore begins the appended data");
    out_.appended = bytes_.substr(underscore + 1);
    Stop();
    return absl::OkStatus();
  }

  absl::StatusOr<VtuDocument> Finish() {
    if (out_.pieces.empty() && !out_.is_index) return Invalid("has no Piece");
    std::sort(out_.all_offsets.begin(), out_.all_offsets.end());
    return std::move(out_);
  }

  absl::string_view bytes_;
  const VtuWanted& wanted_;
  std::unique_ptr<XML_ParserStruct, decltype(&XML_ParserFree)> parser_;
  VtuDocument out_;
  absl::Status status_;
  bool root_ = false, stopped_ = false, out_of_memory_ = false;
  std::string section_;
  VtuArray* array_ =
      nullptr;  // Whose text is under way: one in the last piece, to which none is added meanwhile.
  size_t within_array_ = 0;  // How many elements are open in it.
};

}  // namespace

absl::StatusOr<VtuDocument> ParseVtu(absl::string_view bytes, const VtuWanted& wanted) {
  return VtuParser(bytes, wanted).Parse();
}

}  // namespace ndmap::internal
