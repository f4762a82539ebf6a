// SPDX-License-Identifier: GPL-3.0-or-later
// The end of a phase by Mattern's four counters: two waves, the second begun after the first was complete,
// both with every block idle and with equal, unchanged totals of messages sent and received.
#pragma once

#include <cstdint>

namespace ndmap::coordinator {

class Quiescence {
 public:
  // What one complete wave over all blocks has seen.
  struct Wave {
    bool all_idle = false;
    uint64_t sent = 0;
    uint64_t received = 0;
  };

  // Waves in the order in which they were made, none begun before the one before was complete. True: the
  // phase is over.
  bool Add(const Wave& wave) {
    const bool still = wave.all_idle && wave.sent == wave.received;
    const bool over = still && before_still_ && wave.sent == before_.sent;
    before_still_ = still;
    before_ = wave;
    return over;
  }
  // Whether the last wave was one that may be the first of the two: the next is worth making at once.
  bool MaybeOver() const { return before_still_; }

 private:
  Wave before_;
  bool before_still_ = false;
};

}  // namespace ndmap::coordinator
