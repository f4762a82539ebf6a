// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/names.h"

#include <algorithm>

#include "absl/strings/ascii.h"
#include "absl/strings/escaping.h"
#include "absl/strings/numbers.h"
#include "absl/strings/str_cat.h"

namespace ndmap::service {
namespace {

// What was given, safe to print.
std::string Shown(absl::string_view text) { return absl::CHexEscape(text.substr(0, kMaxNameLength)); }

bool NameCharacter(char c) { return absl::ascii_isalnum(c) || c == '.' || c == '_' || c == '-'; }

}  // namespace

absl::Status CheckName(absl::string_view what, absl::string_view name) {
  if (name.empty()) return absl::InvalidArgumentError(absl::StrCat("the name of the ", what, " is missing"));
  if (name.size() > kMaxNameLength) {
    return absl::InvalidArgumentError(absl::StrCat("the name of the ", what, " has ", name.size(),
                                                   " characters; at most ", kMaxNameLength, " are allowed"));
  }
  if (name[0] == '.' || !std::all_of(name.begin(), name.end(), NameCharacter)) {
    return absl::InvalidArgumentError(absl::StrCat("\"", Shown(name), "\" is no name of a ", what,
                                                   ": letters, digits, '.', '_' and '-', not a dot first"));
  }
  return absl::OkStatus();
}

absl::Status CheckAddress(absl::string_view address) {
  const size_t colon = address.rfind(':');
  uint32_t port = 0;
  bool good = colon != absl::string_view::npos && colon > 0 && address.size() <= 262 &&
              absl::SimpleAtoi(address.substr(colon + 1), &port) && port <= 65535;
  if (good) {
    const absl::string_view host = address.substr(0, colon);
    const bool brackets = host.size() > 2 && host.front() == '[' && host.back() == ']';
    good = std::all_of(host.begin(), host.end(), [brackets](char c) {
      return NameCharacter(c) || (brackets && (c == ':' || c == '[' || c == ']' || c == '%'));
    });
  }
  if (good) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "\"", Shown(address), "\" is no address: HOST:PORT is expected, for example 127.0.0.1:7100"));
}

}  // namespace ndmap::service
