// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/io/surface_scan.h"

#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>

#include "absl/strings/ascii.h"
#include "absl/strings/match.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "core/io/text_scanner.h"

namespace ndmap::internal {
namespace {

// Indices are 32 bits, and CGAL's readers count in int.
constexpr int64_t kMostElements = std::numeric_limits<int32_t>::max() - 1;

absl::Status OffHeader(TextScanner* in, size_t bytes, int64_t* points, int64_t* faces) {
  if (!in->NextLine()) return Invalid("is empty");
  const absl::string_view magic = in->word(0);
  if (magic != "OFF" && magic != "COFF" && magic != "NOFF" && magic != "CNOFF" && magic != "STOFF") {
    return Invalid(absl::StrCat("line ", in->line(), ": begins with ", Shown(magic), "; OFF expected"));
  }
  size_t first = 1;
  if (in->words().size() == 1) {
    first = 0;
    if (!in->NextLine()) return in->Wrong("the numbers of points, faces and edges are missing");
  } else if (in->word(1) == "BINARY") {
    return Invalid("is a binary OFF file; only the text form is known");
  }
  const auto n = in->Integer(first, "the number of points");
  if (!n.ok()) return n.status();
  const auto m = in->Integer(first + 1, "the number of faces");
  if (!m.ok()) return m.status();
  // A point takes 6 bytes at least, a face 8.
  const int64_t size = static_cast<int64_t>(bytes);
  if (*n < 0 || *m < 0 || *n > kMostElements || *m > kMostElements) {
    return Invalid(absl::StrCat("line ", in->line(), ": ", *n, " points and ", *m, " faces cannot be"));
  }
  if (6 * *n + 8 * *m > size + 8) {
    return Invalid(absl::StrCat("truncated: line ", in->line(), " promises ", *n, " points and ", *m,
                                " faces, which cannot be in ", bytes, " bytes"));
  }
  *points = *n;
  *faces = *m;
  return absl::OkStatus();
}

// The index of an OBJ corner: what stands before the first slash.
absl::StatusOr<int64_t> ObjIndex(const TextScanner& in, absl::string_view word, int64_t points) {
  const absl::string_view number = word.substr(0, word.find('/'));
  int64_t index;
  if (!absl::SimpleAtoi(number, &index)) {
    return Invalid(absl::StrCat("line ", in.line(), ": corner ", Shown(word), " is not an index"));
  }
  if (index == 0)
    return Invalid(absl::StrCat("line ", in.line(), ": index 0 out of range; OBJ counts from 1"));
  if (index < -points || index > kMostElements) {
    return Invalid(absl::StrCat("line ", in.line(), ": index ", index, " out of range; ", points,
                                " points stand before it"));
  }
  return index > 0 ? index : points + 1 + index;
}

struct StlText {
  ScannedSurface out;
  int corners = -1;  // Of the facet under way; -1 between facets.

  absl::Status Word(const TextScanner& in, const std::string& word, size_t* i) {
    if (word == "facet") {
      if (corners >= 0) return Invalid(absl::StrCat("line ", in.line(), ": a facet within a facet"));
      corners = 0;
      absl::StrAppend(&out.plain, "facet\n");
    } else if (word == "vertex") {
      if (corners < 0 || corners > 2) {
        return Invalid(
            absl::StrCat("line ", in.line(), ": ",
                         corners < 0 ? "a vertex outside a facet" : "a facet has more than three corners"));
      }
      for (size_t c = 1; c <= 3; ++c) {
        if (absl::Status s = in.CheckCoordinate(*i + c); !s.ok()) return s;
      }
      absl::StrAppend(&out.plain, "vertex ", in.word(*i + 1), " ", in.word(*i + 2), " ", in.word(*i + 3),
                      "\n");
      *i += 3;
      ++corners;
    } else if (word == "endfacet") {
      if (corners != 3) {
        return Invalid(absl::StrCat("line ", in.line(), ": facet ", out.faces, " has ", std::max(corners, 0),
                                    " corners; 3 expected"));
      }
      absl::StrAppend(&out.plain, "endfacet\n");
      ++out.faces;
      corners = -1;
    } else if (word == "normal") {
      *i += 3;  // Not used: orientation follows from the corners, as everywhere.
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      return Invalid(absl::StrCat("line ", in.line(), ": ", Shown(word), " is no word of a text STL file"));
    }
    return absl::OkStatus();
  }
};

absl::StatusOr<ScannedSurface> ScanTextStl(absl::string_view bytes) {
  TextScanner in(bytes, '\0');
  StlText text;
  text.out.plain = "solid\n";
  bool ended = false;
  while (in.NextLine()) {
    for (size_t i = 0; i < in.words().size(); ++i) {
      const std::string word = absl::AsciiStrToLower(in.word(i));
      if (word == "solid" || word == "endsolid") {
        ended = word == "endsolid";
        if (text.corners >= 0)
          return Invalid(absl::StrCat("line ", in.line(), ": ", word, " within a facet"));
        break;  // A name follows.
      }
      if (absl::Status s = text.Word(in, word, &i); !s.ok()) return s;
    }
  }
  if (!ended) {
    return Invalid(absl::StrCat("truncated: the file ends after line ", in.line(), " and facet ",
                                text.out.faces, " without endsolid"));
  }
  absl::StrAppend(&text.out.plain, "endsolid\n");
  return std::move(text.out);
}

absl::StatusOr<ScannedSurface> ScanBinaryStl(absl::string_view bytes, uint32_t facets) {
  constexpr size_t kHeader = 84, kFacet = 50;
  for (uint32_t f = 0; f < facets; ++f) {
    float corners[9];  // After the normal.
    std::memcpy(corners, bytes.data() + kHeader + kFacet * f + 12, sizeof(corners));
    for (float x : corners) {
      if (!std::isfinite(x))
        return Invalid(absl::StrCat("facet ", f, " has a coordinate that is not finite"));
    }
  }
  ScannedSurface out{std::string(bytes), std::nullopt, facets};
  out.plain[0] = 'b';  // A binary file may begin with "solid", too: CGAL would take it for text.
  return out;
}

}  // namespace

absl::StatusOr<ScannedSurface> ScanOff(absl::string_view bytes) {
  TextScanner in(bytes, '#');
  int64_t points = 0, faces = 0;
  if (absl::Status s = OffHeader(&in, bytes.size(), &points, &faces); !s.ok()) return s;
  ScannedSurface out{absl::StrCat("OFF\n", points, " ", faces, " 0\n"), points, static_cast<size_t>(faces)};
  out.plain.reserve(bytes.size());
  for (int64_t p = 0; p < points; ++p) {
    if (!in.NextLine())
      return Invalid(absl::StrCat("truncated: ", points, " points promised, the file has ", p));
    for (size_t c = 0; c < 3; ++c) {
      if (absl::Status s = in.CheckCoordinate(c); !s.ok()) return s;
    }
    absl::StrAppend(&out.plain, in.word(0), " ", in.word(1), " ", in.word(2), "\n");
  }
  for (int64_t f = 0; f < faces; ++f) {
    if (!in.NextLine())
      return Invalid(absl::StrCat("truncated: ", faces, " faces promised, the file has ", f));
    const auto corners = in.Integer(0, "the number of corners");
    if (!corners.ok()) return corners.status();
    if (*corners < 0 || *corners >= static_cast<int64_t>(in.words().size())) {
      return in.Wrong(
          absl::StrCat("face ", f, " promises ", *corners, " corners, the line has ", in.words().size() - 1));
    }
    absl::StrAppend(&out.plain, *corners);
    for (int64_t c = 1; c <= *corners; ++c) {
      const auto index = in.Integer(c, "index");
      if (!index.ok()) return index.status();
      if (*index < 0 || *index >= points) {
        return Invalid(absl::StrCat("line ", in.line(), ": face ", f, " has index ", *index,
                                    " out of range; there are ", points, " points, counted from 0"));
      }
      absl::StrAppend(&out.plain, " ", *index);
    }
    absl::StrAppend(&out.plain, "\n");
  }
  return out;
}

absl::StatusOr<ScannedSurface> ScanObj(absl::string_view bytes) {
  TextScanner in(bytes, '#');
  ScannedSurface out;
  int64_t points = 0, largest = 0;
  size_t largest_line = 0;
  bool any = false;
  while (in.NextLine()) {
    any = true;
    if (in.word(0) == "v") {
      for (size_t c = 1; c <= 3; ++c) {
        if (absl::Status s = in.CheckCoordinate(c); !s.ok()) return s;
      }
      absl::StrAppend(&out.plain, "v ", in.word(1), " ", in.word(2), " ", in.word(3), "\n");
      ++points;
    } else if (in.word(0) == "f") {
      absl::StrAppend(&out.plain, "f");
      for (size_t i = 1; i < in.words().size(); ++i) {
        const auto index = ObjIndex(in, in.word(i), points);
        if (!index.ok()) return index.status();
        if (*index > largest) largest = *index, largest_line = in.line();
        absl::StrAppend(&out.plain, " ", *index);
      }
      absl::StrAppend(&out.plain, "\n");
      ++out.faces;
    } else if (!absl::ascii_isalpha(in.word(0)[0])) {
      return Invalid(
          absl::StrCat("line ", in.line(), ": begins with ", Shown(in.word(0)), ", which is no OBJ keyword"));
    }
  }
  if (!any) return Invalid("is empty");
  if (largest > points) {
    return Invalid(absl::StrCat("line ", largest_line, ": index ", largest, " out of range; there are ",
                                points, " points"));
  }
  out.points = points;
  return out;
}

absl::StatusOr<ScannedSurface> ScanStl(absl::string_view bytes) {
  if (absl::StripAsciiWhitespace(bytes).empty()) return Invalid("is empty");
  uint32_t facets = 0;
  if (bytes.size() >= 84) std::memcpy(&facets, bytes.data() + 80, sizeof(facets));
  const uint64_t expected = 84 + uint64_t{50} * facets;
  if (bytes.size() >= 84 && bytes.size() == expected) return ScanBinaryStl(bytes, facets);
  if (absl::EqualsIgnoreCase(absl::StripLeadingAsciiWhitespace(bytes).substr(0, 5), "solid")) {
    return ScanTextStl(bytes);
  }
  if (bytes.size() < 84) {
    return Invalid(absl::StrCat("truncated: ", bytes.size(), " bytes; a binary STL file has 84 and more"));
  }
  return Invalid(absl::StrCat(bytes.size() < expected ? "truncated: " : "", "the header promises ", facets,
                              " facets in ", expected, " bytes; the file has ", bytes.size()));
}

}  // namespace ndmap::internal
