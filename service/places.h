// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <atomic>
#include <cstdint>

namespace ndmap::service {

// Calls of one kind that a service has at one time, at most so many: each of them keeps a thread.
// Thread-safe.
class Places {
 public:
  explicit Places(uint32_t most) : most_(most) {}
  Places(const Places&) = delete;
  Places& operator=(const Places&) = delete;

  uint32_t most() const { return most_; }

  // One place, if there was one, until the end of the call.
  class Place {
   public:
    explicit Place(Places& places) : places_(places), taken_(places.Take()) {}
    ~Place() {
      if (taken_) --places_.in_use_;
    }
    Place(const Place&) = delete;
    Place& operator=(const Place&) = delete;
    bool taken() const { return taken_; }

   private:
    Places& places_;
    const bool taken_;
  };

 private:
  bool Take() {
    uint32_t now = in_use_.load();
    while (now < most_) {
      if (in_use_.compare_exchange_weak(now, now + 1)) return true;
    }
    return false;
  }

  const uint32_t most_;
  std::atomic<uint32_t> in_use_{0};
};

}  // namespace ndmap::service
