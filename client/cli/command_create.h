// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "client/cli/context.h"

namespace ndmap::cli {

// `ndmap create`: a map from a surface and a grid, or from a mesh.
void AddCreateCommand(CLI::App& app, Action& action);

}  // namespace ndmap::cli
