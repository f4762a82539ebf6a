// SPDX-License-Identifier: GPL-3.0-or-later
// Threads that run actors a slice at a time, first come first served.
#pragma once

#include <list>
#include <memory>
#include <thread>
#include <vector>

#include "absl/base/thread_annotations.h"
#include "server/mutex.h"

namespace ndmap::server {

class Runnable {
 public:
  virtual ~Runnable() = default;
  // Runs for some milliseconds. True: queue it again, behind the others. The pool never runs one twice at
  // once as long as its owner enqueues it only when its last slice returned false.
  virtual bool RunSlice() = 0;
  // The pool has stopped, or stops now: no slice runs, and none will.
  virtual void Dropped() {}
};

class WorkerPool {
 public:
  // At least one thread.
  explicit WorkerPool(unsigned threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // False when the pool has stopped: it will not run.
  bool Enqueue(std::shared_ptr<Runnable> runnable);
  // Lets running slices end, joins the threads, tells what waits that it was dropped. Twice is no error.
  void Stop();

 private:
  void Run();

  Mutex mutex_;
  CondVar changed_;
  // A list: what goes on waits again without asking for memory.
  std::list<std::shared_ptr<Runnable>> queue_ ABSL_GUARDED_BY(mutex_);
  bool stopping_ ABSL_GUARDED_BY(mutex_) = false;
  std::vector<std::thread> threads_;
};

}  // namespace ndmap::server
