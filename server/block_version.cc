// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/block_version.h"

#include "absl/strings/str_cat.h"

namespace ndmap::server {

absl::Status CheckVersion(const Block3& block, uint64_t version) {
  if (version == 0 || version == block.version()) return absl::OkStatus();
  return absl::FailedPreconditionError(absl::StrCat("block ", block.id().value, " has changed since version ",
                                                    version, " (it is at ", block.version(),
                                                    " now): ask for its darts again"));
}

absl::Status CheckUnchanged(const Block3& block, uint64_t version) {
  if (version == block.version()) return absl::OkStatus();
  return absl::AbortedError(absl::StrCat("block ", block.id().value, " changed during the query"));
}

}  // namespace ndmap::server
