// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <vector>

#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/io/surface_scan.h"
#include "core/io/text_scanner.h"

namespace ndmap::internal {
namespace {

enum class Encoding { kText, kLittleEndian, kBigEndian };
enum class Role { kSkip, kX, kY, kZ, kCorners };

struct Type {
  const char *name, *other_name;
  int bytes;
  bool integer, is_signed;
};
constexpr Type kTypes[] = {{"char", "int8", 1, true, true},      {"uchar", "uint8", 1, true, false},
                           {"short", "int16", 2, true, true},    {"ushort", "uint16", 2, true, false},
                           {"int", "int32", 4, true, true},      {"uint", "uint32", 4, true, false},
                           {"float", "float32", 4, false, true}, {"double", "float64", 8, false, true}};

struct Property {
  const Type* type = nullptr;
  const Type* count = nullptr;  // Of a list; null for a scalar.
  Role role = Role::kSkip;
};

struct Element {
  std::string name;
  int64_t items = 0;
  std::vector<Property> properties;
};

struct Header {
  Encoding encoding = Encoding::kText;
  std::vector<Element> elements;
  size_t bytes = 0;
  size_t lines = 0;
};

absl::StatusOr<const Type*> TypeOf(const TextScanner& in, size_t i) {
  if (i >= in.words().size()) return in.Wrong("a property needs a type and a name");
  for (const Type& type : kTypes) {
    if (in.word(i) == type.name || in.word(i) == type.other_name) return &type;
  }
  return Invalid(absl::StrCat("line ", in.line(), ": ", Shown(in.word(i)), " is no PLY type"));
}

absl::Status ReadProperty(const TextScanner& in, Element* element) {
  Property property;
  const bool list = in.words().size() > 1 && in.word(1) == "list";
  if (list) {
    const auto count = TypeOf(in, 2);
    if (!count.ok()) return count.status();
    property.count = *count;
    if (!property.count->integer)
      return Invalid(absl::StrCat("line ", in.line(), ": a list's length is an integer"));
  }
  const auto type = TypeOf(in, list ? 3 : 1);
  if (!type.ok()) return type.status();
  property.type = *type;
  const size_t at = list ? 4 : 2;
  if (at >= in.words().size()) return in.Wrong("a property needs a name");
  const absl::string_view name = in.word(at);
  if (element->name == "vertex" && !list) {
    property.role = name == "x" ? Role::kX : name == "y" ? Role::kY : name == "z" ? Role::kZ : Role::kSkip;
  } else if (element->name == "face" && list && (name == "vertex_indices" || name == "vertex_index")) {
    property.role = Role::kCorners;
    if (!property.type->integer)
      return Invalid(absl::StrCat("line ", in.line(), ": ", name, " must be integers"));
  }
  for (const Property& other : element->properties) {
    if (property.role != Role::kSkip && other.role == property.role) {
      return Invalid(absl::StrCat("line ", in.line(), ": ", element->name, " has ", Shown(name), " twice"));
    }
  }
  element->properties.push_back(property);
  return absl::OkStatus();
}

absl::Status ReadElement(const TextScanner& in, Header* header) {
  if (in.words().size() < 3) return in.Wrong("an element needs a name and a number");
  const auto items = in.Integer(2, "the number of elements");
  if (!items.ok()) return items.status();
  if (*items < 0 || *items >= std::numeric_limits<int32_t>::max()) {
    return Invalid(absl::StrCat("line ", in.line(), ": ", *items, " elements cannot be"));
  }
  Element element;
  element.name = std::string(in.word(1));
  if (element.name == "vertices") element.name = "vertex";
  if (element.name == "faces") element.name = "face";
  for (const Element& other : header->elements) {
    if (other.name == element.name) {
      return Invalid(absl::StrCat("line ", in.line(), ": a second element ", Shown(element.name)));
    }
  }
  element.items = *items;
  header->elements.push_back(element);
  return absl::OkStatus();
}

absl::Status CheckElements(const std::vector<Element>& elements) {
  int has_vertices = 0, has_faces = 0;
  for (const Element& element : elements) {
    const auto has = [&element](Role role) {
      return std::any_of(element.properties.begin(), element.properties.end(),
                         [role](const Property& p) { return p.role == role; });
    };
    if (element.properties.empty() && element.items > 0) {
      return Invalid(absl::StrCat("header: element ", Shown(element.name), " has no properties"));
    }
    if (element.name == "vertex" && element.items > 0 && !(has(Role::kX) && has(Role::kY) && has(Role::kZ))) {
      return Invalid("header: vertices need the properties x, y and z");
    }
    if (element.name == "face" && element.items > 0 && !has(Role::kCorners)) {
      return Invalid("header: faces need a list vertex_indices or vertex_index");
    }
    has_vertices += element.name == "vertex";
    has_faces += element.name == "face";
  }
  if (!has_vertices) return Invalid("header: there is no element vertex");
  if (!has_faces) return Invalid("has no faces: the header has no element face");
  return absl::OkStatus();
}

absl::StatusOr<Header> ReadHeader(absl::string_view bytes) {
  if (bytes.find_first_not_of(" \t\r\n") == absl::string_view::npos) return Invalid("is empty");
  constexpr absl::string_view kEnd = "end_header";
  size_t end = 0;
  do {  // Only at the beginning of a line: a comment may name it.
    end = bytes.find(kEnd, end + 1);
  } while (end != absl::string_view::npos && bytes[end - 1] != '\n');
  if (!absl::StartsWith(bytes, "ply")) return Invalid("line 1: does not begin with ply");
  if (end == absl::string_view::npos) return Invalid("truncated: the header has no end_header");
  Header header;
  const size_t newline = bytes.find('\n', end);
  if (newline == absl::string_view::npos) return Invalid("truncated: the file ends with its header");
  header.bytes = newline + 1;
  TextScanner in(bytes.substr(0, newline), '\0');
  bool has_format = false;
  in.NextLine();
  while (in.NextLine() && in.word(0) != kEnd) {
    const absl::string_view word = in.word(0);
    absl::Status status;
    if (word == "format") {
      const absl::string_view format = in.words().size() > 1 ? in.word(1) : "";
      has_format = format == "ascii" || format == "binary_little_endian" || format == "binary_big_endian";
      if (!has_format)
        return Invalid(absl::StrCat("line ", in.line(), ": ", Shown(format), " is no PLY format"));
      header.encoding = format == "ascii"                  ? Encoding::kText
                        : format == "binary_little_endian" ? Encoding::kLittleEndian
                                                           : Encoding::kBigEndian;
    } else if (word == "element") {
      status = ReadElement(in, &header);
    } else if (word == "property") {
      if (header.elements.empty())
        return Invalid(absl::StrCat("line ", in.line(), ": a property without an element"));
      status = ReadProperty(in, &header.elements.back());
    } else if (word != "comment" && word != "obj_info") {
      return Invalid(absl::StrCat("line ", in.line(), ": ", Shown(word), " is no word of a PLY header"));
    }
    if (!status.ok()) return status;
  }
  if (!has_format) return Invalid("header: the format is missing");
  header.lines = in.line();
  if (absl::Status s = CheckElements(header.elements); !s.ok()) return s;
  return header;
}

// The values of the body, one after the other, in whatever encoding.
class Body {
 public:
  Body(absl::string_view bytes, const Header& header)
      : encoding_(header.encoding),
        rest_(bytes.substr(header.bytes)),
        text_(rest_, '\0'),
        lines_(header.lines) {}

  absl::Status Next(const Type& type, double* value) {
    if (encoding_ == Encoding::kText) return NextWord(value);
    if (rest_.size() < static_cast<size_t>(type.bytes)) return Invalid("truncated: the file ends in it");
    *value = Decode(type);
    rest_.remove_prefix(type.bytes);
    return absl::OkStatus();
  }

  // "" or where in a text the last value was.
  std::string Where() const {
    return encoding_ == Encoding::kText ? absl::StrCat("line ", lines_ + text_.line(), ": ") : "";
  }

 private:
  absl::Status NextWord(double* value) {
    if (word_ >= text_.words().size()) {
      if (!text_.NextLine()) return Invalid("truncated: the file ends in it");
      word_ = 0;
    }
    const absl::string_view word = text_.word(word_++);
    if (!absl::SimpleAtod(word, value)) return Invalid(absl::StrCat(Shown(word), " is not a number"));
    return absl::OkStatus();
  }

  double Decode(const Type& type) const {
    char raw[8];
    std::copy_n(rest_.data(), type.bytes, raw);
    if (encoding_ == Encoding::kBigEndian) std::reverse(raw, raw + type.bytes);
    const auto as = [&raw](auto value) {
      std::memcpy(&value, raw, sizeof(value));
      return static_cast<double>(value);
    };
    if (!type.integer) return type.bytes == 4 ? as(float{}) : as(double{});
    if (type.bytes == 1) return type.is_signed ? as(int8_t{}) : as(uint8_t{});
    if (type.bytes == 2) return type.is_signed ? as(int16_t{}) : as(uint16_t{});
    return type.is_signed ? as(int32_t{}) : as(uint32_t{});
  }

  Encoding encoding_;
  absl::string_view rest_;
  TextScanner text_;
  size_t lines_, word_ = 0;
};

template <class T>
void Append(T value, std::string* out) {
  out->append(reinterpret_cast<const char*>(&value), sizeof(value));
}

struct Copier {
  Body body;
  int64_t points = 0;
  std::string vertices{}, faces{};  // In plain form.

  absl::Status List(const Property& property) {
    double count = 0, value = 0;
    if (absl::Status s = body.Next(*property.count, &count); !s.ok()) return s;
    if (!(count >= 0 && count < 1e9 && count == std::floor(count))) {
      return Invalid(absl::StrCat("a list of ", count, " values"));
    }
    const bool corners = property.role == Role::kCorners;
    if (corners) Append(static_cast<uint32_t>(count), &faces);
    for (int64_t i = 0; i < static_cast<int64_t>(count); ++i) {  // Ends with the file at the latest.
      if (absl::Status s = body.Next(*property.type, &value); !s.ok()) return s;
      if (!corners) continue;
      if (!(value >= 0 && value < points)) {
        return Invalid(
            absl::StrCat("index ", value, " out of range; there are ", points, " points, counted from 0"));
      }
      if (value != std::floor(value)) return Invalid(absl::StrCat("index ", value, " is not an integer"));
      Append(static_cast<int32_t>(value), &faces);
    }
    return absl::OkStatus();
  }

  absl::Status Item(const Element& element) {
    double point[3] = {0, 0, 0}, unused;
    for (const Property& property : element.properties) {
      absl::Status status;
      if (property.count != nullptr) {
        status = List(property);
      } else {
        const int axis = static_cast<int>(property.role) - static_cast<int>(Role::kX);
        const bool wanted = property.role != Role::kSkip;
        status = body.Next(*property.type, wanted ? &point[axis] : &unused);
        if (status.ok() && wanted && !std::isfinite(point[axis])) {
          status = Invalid("has a coordinate that is not finite");
        }
      }
      if (!status.ok()) return status;
    }
    if (element.name == "vertex") {
      for (double x : point) Append(x, &vertices);
    }
    return absl::OkStatus();
  }
};

}  // namespace

absl::StatusOr<ScannedSurface> ScanPly(absl::string_view bytes) {
  const auto header = ReadHeader(bytes);
  if (!header.ok()) return header.status();
  Copier copier{Body(bytes, *header)};
  int64_t faces = 0;
  for (const Element& element : header->elements) {
    if (element.name == "vertex") copier.points = element.items;
    if (element.name == "face") faces = element.items;
  }
  for (const Element& element : header->elements) {
    for (int64_t i = 0; i < element.items; ++i) {
      if (absl::Status s = copier.Item(element); !s.ok()) {
        return Invalid(absl::StrCat(copier.body.Where(), element.name, " ", i, " of ", element.items, ": ",
                                    s.message()));
      }
    }
  }
  // This machine's byte order is little-endian, as everywhere that CGAL's own reader of the little-endian
  // form works.
  ScannedSurface out;
  out.plain =
      absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ", copier.points,
                   "\nproperty double x\nproperty double y\nproperty double z\nelement face ", faces,
                   "\nproperty list uint int vertex_indices\nend_header\n", copier.vertices, copier.faces);
  out.points = copier.points;
  out.faces = faces;
  return out;
}

}  // namespace ndmap::internal
