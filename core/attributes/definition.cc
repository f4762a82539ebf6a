// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/attributes/definition.h"

#include <set>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"
#include "absl/strings/str_split.h"

namespace ndmap {
namespace {

constexpr size_t kMaxName = 128;
constexpr size_t kFields = 9;

bool IsName(absl::string_view name) {
  if (name.empty() || name.size() > kMaxName || name[0] == '.') return false;
  for (char c : name) {
    if (!absl::ascii_isalnum(static_cast<unsigned char>(c)) && c != '.' && c != '_' && c != '-') return false;
  }
  return true;
}

absl::StatusOr<AttributeDefinition> Decode(absl::string_view line) {
  const std::vector<absl::string_view> fields = absl::StrSplit(line, ' ');
  const auto wrong = [line] {
    return absl::InvalidArgumentError(absl::StrCat("not the definition of an attribute: \"", line, "\""));
  };
  if (fields.size() != kFields) return wrong();
  AttributeDefinition d;
  d.name = std::string(fields[0]);
  uint32_t type = 0, split = 0;
  if (!absl::SimpleAtoi(fields[1], &d.dimension) || !absl::SimpleAtoi(fields[2], &type) ||
      !absl::SimpleAtoi(fields[3], &split) || !absl::SimpleAtoi(fields[4], &d.number)) {
    return wrong();
  }
  for (int c = 0; c < 3; ++c) {
    if (!absl::SimpleAtoi(fields[5 + c], &d.fill[c])) return wrong();
  }
  for (char c : fields[8]) {
    if (!absl::ascii_isxdigit(static_cast<unsigned char>(c))) return wrong();
  }
  if (fields[8].size() % 2 != 0 || type < 1 || type > 4 || split < 1 || split > 5) return wrong();
  d.fill_text = absl::HexStringToBytes(fields[8]);
  d.type = static_cast<ValueType>(type);
  d.split = static_cast<SplitRule>(split);
  if (absl::Status s = Validate(d); !s.ok()) return s;
  return d;
}

}  // namespace

absl::Status Validate(const AttributeDefinition& d) {
  if (!IsName(d.name)) {
    return absl::InvalidArgumentError(absl::StrCat("\"", absl::CHexEscape(d.name.substr(0, kMaxName)),
                                                   "\" is no name of an attribute: expected 1 to 128 "
                                                   "characters of A-Z a-z 0-9 . _ -, the first no dot"));
  }
  if (d.dimension > 3) {
    return absl::InvalidArgumentError(
        absl::StrCat("attribute ", d.name, ": cells of dimension ", d.dimension, ", expected 0 to 3"));
  }
  if (d.fill_text.size() > AttributeDefinition::kMaxCategoryBytes) {
    return absl::InvalidArgumentError(absl::StrCat("attribute ", d.name, ": a category of ",
                                                   d.fill_text.size(), " bytes, expected at most ",
                                                   AttributeDefinition::kMaxCategoryBytes));
  }
  const bool means = d.split == SplitRule::kMean || d.split == SplitRule::kMidpoint;
  if (means && (d.dimension != 0 || d.type == ValueType::kCategory)) {
    return absl::InvalidArgumentError(
        absl::StrCat("attribute ", d.name, ": the rules mean and midpoint are for numbers on vertices"));
  }
  const bool fractions = d.type == ValueType::kDouble || d.type == ValueType::kVec3;
  if (d.split == SplitRule::kDivide && (d.dimension == 0 || !fractions)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "attribute ", d.name, ": the rule divide is for double and vec3 on edges, faces and hexahedra"));
  }
  return absl::OkStatus();
}

std::string EncodeDefinitions(const std::vector<AttributeDefinition>& definitions) {
  std::string text;
  for (const AttributeDefinition& d : definitions) {
    absl::StrAppend(&text, d.name, " ", d.dimension, " ", static_cast<int>(d.type), " ",
                    static_cast<int>(d.split), " ");
    absl::StrAppend(&text, d.number, " ", d.fill[0], " ", d.fill[1], " ", d.fill[2], " ",
                    absl::BytesToHexString(d.fill_text), "\n");
  }
  return text;
}

absl::StatusOr<std::vector<AttributeDefinition>> DecodeDefinitions(absl::string_view text) {
  std::vector<AttributeDefinition> definitions;
  std::set<std::string> names;
  for (absl::string_view line : absl::StrSplit(text, '\n')) {
    if (line.empty()) continue;
    absl::StatusOr<AttributeDefinition> d = Decode(line);
    if (!d.ok()) return d.status();
    if (!names.insert(d->name).second) {
      return absl::InvalidArgumentError(absl::StrCat("two attributes with the name ", d->name));
    }
    definitions.push_back(*std::move(d));
    if (definitions.size() > AttributeDefinition::kMaxAttributes) {
      return absl::InvalidArgumentError(
          absl::StrCat("more than ", AttributeDefinition::kMaxAttributes, " attributes"));
    }
  }
  return definitions;
}

}  // namespace ndmap
