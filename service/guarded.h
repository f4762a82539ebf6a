// SPDX-License-Identifier: GPL-3.0-or-later
// What a library throws fails what was asked for, not the process.
#pragma once

#include <exception>
#include <new>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace ndmap::service {

// What f returns, a Status or a StatusOr; or what it throws, as one: RESOURCE_EXHAUSTED when memory ran out,
// otherwise INTERNAL. Sets *thrown then.
template <class F>
auto Guarded(F&& f, bool* thrown = nullptr) -> decltype(f()) {
  try {
    return f();
  } catch (const std::bad_alloc&) {
    if (thrown != nullptr) *thrown = true;
    return absl::ResourceExhaustedError("out of memory");
  } catch (const std::exception& e) {
    if (thrown != nullptr) *thrown = true;
    return absl::InternalError(absl::StrCat("exception: ", e.what()));
  }
}

}  // namespace ndmap::service
