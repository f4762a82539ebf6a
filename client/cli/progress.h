// SPDX-License-Identifier: GPL-3.0-or-later
// What is going on, on standard error: one line that is redrawn on a terminal, one line a step otherwise.
#pragma once

#include <cstdio>
#include <string>

#include "absl/base/thread_annotations.h"
#include "absl/strings/string_view.h"
#include "absl/synchronization/mutex.h"
#include "absl/time/time.h"

namespace ndmap::cli {

// The bar itself: "[#####.....]", `width` characters in all (at least 3), for a fraction of 0 ... 1.
std::string Bar(double fraction, int width);

// Thread-safe.
class Progress {
 public:
  // `terminal`: redraw with carriage returns. `quiet`: only notes.
  Progress(std::FILE* out, bool terminal, bool quiet);
  // Standard error as it is.
  static bool IsTerminal(std::FILE* out);

  // A step begins: "refine level 2".
  void Begin(absl::string_view step);
  // How far it is, or -1 when nobody knows, and what to say beside it. Drawn at most ten times a second.
  void Update(double fraction, absl::string_view detail);
  // The step is done: its line stays. `seconds`: how long it took, if somebody knows better than the clock
  // here.
  void End(absl::string_view detail, double seconds = -1);
  // The step is not done: its line goes away.
  void Abandon();
  // A line of its own, whatever is going on.
  void Note(absl::string_view line);

 private:
  void Draw() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);
  void Erase() ABSL_EXCLUSIVE_LOCKS_REQUIRED(mutex_);

  std::FILE* const out_;
  const bool terminal_;
  const bool quiet_;
  absl::Mutex mutex_;
  bool busy_ ABSL_GUARDED_BY(mutex_) = false;
  std::string step_ ABSL_GUARDED_BY(mutex_);
  std::string detail_ ABSL_GUARDED_BY(mutex_);
  double fraction_ ABSL_GUARDED_BY(mutex_) = -1;
  absl::Time begun_ ABSL_GUARDED_BY(mutex_);
  absl::Time drawn_ ABSL_GUARDED_BY(mutex_) = absl::InfinitePast();
};

}  // namespace ndmap::cli
