// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/worker_pool.h"

#include <algorithm>
#include <utility>

namespace ndmap::server {

WorkerPool::WorkerPool(unsigned threads) {
  for (unsigned i = 0; i < std::max(threads, 1u); ++i) threads_.emplace_back([this] { Run(); });
}

WorkerPool::~WorkerPool() { Stop(); }

bool WorkerPool::Enqueue(std::shared_ptr<Runnable> runnable) {
  MutexLock lock(&mutex_);
  if (stopping_) return false;
  queue_.push_back(std::move(runnable));
  changed_.Signal();
  return true;
}

void WorkerPool::Stop() {
  std::list<std::shared_ptr<Runnable>> dropped;
  {
    MutexLock lock(&mutex_);
    stopping_ = true;
    dropped.swap(queue_);
    changed_.SignalAll();
  }
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
  for (const std::shared_ptr<Runnable>& runnable : dropped) runnable->Dropped();
}

void WorkerPool::Run() {
  // What this thread runs: one, or none.
  std::list<std::shared_ptr<Runnable>> running;
  while (true) {
    {
      MutexLock lock(&mutex_);
      if (!stopping_) queue_.splice(queue_.end(), running);
      while (queue_.empty() && !stopping_) changed_.Wait(&mutex_);
      if (stopping_) break;
      running.splice(running.end(), queue_, queue_.begin());
    }
    if (!running.front()->RunSlice()) running.clear();
  }
  for (const std::shared_ptr<Runnable>& runnable : running) runnable->Dropped();
}

}  // namespace ndmap::server
