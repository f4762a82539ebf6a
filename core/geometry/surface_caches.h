// SPDX-License-Identifier: GPL-3.0-or-later
// What is computed from a surface once and then kept. Any number of threads may ask at once: one computes,
// the others wait for it.
#pragma once

#include <memory>
#include <mutex>

#include "absl/functional/function_ref.h"
#include "absl/status/statusor.h"
#include "core/geometry/parity.h"
#include "core/geometry/surface.h"
#include "core/geometry/surface_index.h"

namespace ndmap {

// One block's index of the triangles near it: made once, because hexahedra only get smaller or fewer.
class IndexCache {
 public:
  // `region` is asked only when there is no index yet.
  absl::StatusOr<std::shared_ptr<const SurfaceIndex>> Get(
      const std::shared_ptr<const TriangleSurface>& surface,
      absl::FunctionRef<absl::StatusOr<Box3>()> region) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (index_ != nullptr) return index_;
    const absl::StatusOr<Box3> box = region();
    if (!box.ok()) return box.status();
    index_ = std::make_shared<const SurfaceIndex>(surface, *box);
    return index_;
  }

 private:
  std::mutex mutex_;
  std::shared_ptr<const SurfaceIndex> index_;
};

// The parity of one surface, for all blocks of a process.
class ParityCache {
 public:
  std::shared_ptr<const ParityIndex> Get(const std::shared_ptr<const TriangleSurface>& surface) {
    std::lock_guard<std::mutex> lock(mutex_);
    if (index_ == nullptr) {
      index_ = std::make_shared<const ParityIndex>(surface);
      ++made_;
    }
    return index_;
  }
  // How often it was computed: 0 or 1.
  int made() const {
    std::lock_guard<std::mutex> lock(mutex_);
    return made_;
  }

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const ParityIndex> index_;
  int made_ = 0;
};

}  // namespace ndmap
