// SPDX-License-Identifier: GPL-3.0-or-later
// What the commands below "attr" share.
#pragma once

#include <string>

#include "absl/status/statusor.h"
#include "client/cli/context.h"
#include "ndmap/v1/attributes.pb.h"

namespace ndmap::cli {

// How many cells were written; NOT_FOUND after that when some ids are not there.
absl::StatusOr<int> PrintWritten(Context& context, const std::string& map, const v1::Attribute& attribute,
                                 const absl::StatusOr<v1::WriteAttributeResponse>& answer);

// attr write.
void AddWriteCommand(CLI::App& attr, Action& action);

}  // namespace ndmap::cli
