// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/worker_pool.h"

#include <algorithm>
#include <utility>

namespace ndmap::server {

WorkerPool::WorkerPool(unsigned threads) {
  for (unsigned i = 0; i < std::max(threads, 1u); ++i) threads_.emplace_back([this] { Run(); });
}

WorkerPool::~WorkerPool() { Stop(); }

void WorkerPool::Enqueue(std::shared_ptr<Runnable> runnable) {
  MutexLock lock(&mutex_);
  if (stopping_) return;
  queue_.push_back(std::move(runnable));
  changed_.Signal();
}

void WorkerPool::Stop() {
  std::deque<std::shared_ptr<Runnable>> dropped;
  {
    MutexLock lock(&mutex_);
    stopping_ = true;
    dropped.swap(queue_);
    changed_.SignalAll();
  }
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

void WorkerPool::Run() {
  std::shared_ptr<Runnable> runnable;
  bool again = false;
  while (true) {
    {
      MutexLock lock(&mutex_);
      if (again && !stopping_) queue_.push_back(std::move(runnable));
      while (queue_.empty() && !stopping_) changed_.Wait(&mutex_);
      if (stopping_) break;
      runnable = std::move(queue_.front());
      queue_.pop_front();
    }
    again = runnable->RunSlice();
    if (!again) runnable.reset();
  }
}

}  // namespace ndmap::server
