// SPDX-License-Identifier: GPL-3.0-or-later
// Ctrl-C, SIGTERM and the terminal's hang-up: the first asks for an orderly end, the second ends at once.
#pragma once

#include <functional>
#include <thread>

#include "absl/base/thread_annotations.h"
#include "absl/synchronization/mutex.h"

namespace ndmap::cli {

// Made once, at the beginning of main(), before any other thread: the signals are blocked everywhere and a
// thread of this object waits for them. There is one in a process, because signals belong to the process.
class Interrupts {
 public:
  Interrupts();
  // Signals are left blocked: the process is about to end.
  ~Interrupts();
  Interrupts(const Interrupts&) = delete;
  Interrupts& operator=(const Interrupts&) = delete;

  // At the first signal `gently` is called in a thread of its own, at the second `at_once` in the signal
  // thread, whatever `gently` is doing; then the process ends with 128 + signal. It also ends so after
  // `gently` if that returns true; false leaves the end to the main thread. Without handlers it ends at the
  // first signal. `at_once` must not wait for anything.
  void SetHandlers(std::function<bool()> gently, std::function<void()> at_once);
  // Waits for a `gently` that is running, then forgets both.
  void ClearHandlers();

  // Whether there was a signal, and which; 0 if none.
  int signal() const;
  // For the main thread after an error: if a signal came, its handler has the last word, so wait for the end.
  void YieldToHandler();

 private:
  void Run();
  [[noreturn]] static void Exit(int signal);

  mutable absl::Mutex mutex_;
  std::function<bool()> gently_ ABSL_GUARDED_BY(mutex_);
  std::function<void()> at_once_ ABSL_GUARDED_BY(mutex_);
  int signal_ ABSL_GUARDED_BY(mutex_) = 0;
  bool running_ ABSL_GUARDED_BY(mutex_) = false;
  bool stop_ = false;
  std::thread thread_;
};

// In a child between fork and exec: gives it the signals back that Interrupts blocked.
void UnblockSignalsInChild();

}  // namespace ndmap::cli
