// SPDX-License-Identifier: GPL-3.0-or-later
#include "service/version.h"

#include <string>

#include "absl/strings/escaping.h"
#include "absl/strings/str_cat.h"

namespace ndmap::service {

v1::Version MakeVersion(absl::string_view program) {
  v1::Version version;
  version.set_protocol(v1::PROTOCOL_CURRENT);
  version.set_release(kRelease);
  version.set_program(std::string(program));
  return version;
}

absl::Status CheckVersion(const v1::Version& own, const v1::Version& other) {
  if (own.protocol() == other.protocol()) return absl::OkStatus();
  return absl::FailedPreconditionError(
      absl::StrCat(own.program(), " ", own.release(), " speaks protocol ", own.protocol(), ", but ",
                   other.program().empty() ? "the caller" : absl::CHexEscape(other.program()), " ",
                   absl::CHexEscape(other.release()), " speaks protocol ", other.protocol(),
                   ": use the same release of both"));
}

}  // namespace ndmap::service
