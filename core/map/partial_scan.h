// SPDX-License-Identifier: GPL-3.0-or-later
// Going over a container of a block a part at a time, so that others get their turn in between.
#pragma once

#include <cstddef>
#include <optional>
#include <utility>

namespace ndmap {

// The container outlives the scan and must not change before the scan is over.
template <class Container>
class PartialScan {
 public:
  explicit PartialScan(Container& container) : container_(container) {}

  // Calls f(iterator) for the next elements, *budget of them at most, and lowers *budget by their number.
  // True when there are no more.
  template <class F>
  bool Next(size_t* budget, F f) {
    if (!at_.has_value()) at_ = container_.begin();
    for (; *budget > 0 && *at_ != container_.end(); ++*at_, --*budget) f(*at_);
    return *at_ == container_.end();
  }

 private:
  Container& container_;
  std::optional<decltype(std::declval<Container&>().begin())> at_;
};

}  // namespace ndmap
