// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/interrupt.h"

#include <signal.h>
#include <unistd.h>

#include <utility>

namespace ndmap::cli {
namespace {

// SIGUSR1 is how the destructor wakes the thread.
sigset_t Waited() {
  sigset_t set;
  sigemptyset(&set);
  for (int signal : {SIGINT, SIGTERM, SIGHUP, SIGUSR1}) sigaddset(&set, signal);
  return set;
}

}  // namespace

Interrupts::Interrupts() {
  const sigset_t set = Waited();
  pthread_sigmask(SIG_BLOCK, &set, nullptr);
  // A pipe or socket whose reader is gone gives an error instead of a signal.
  ::signal(SIGPIPE, SIG_IGN);
  thread_ = std::thread([this] { Run(); });
}

Interrupts::~Interrupts() {
  ClearHandlers();
  {
    absl::MutexLock lock(&mutex_);
    stop_ = true;
  }
  pthread_kill(thread_.native_handle(), SIGUSR1);
  thread_.join();
}

void Interrupts::SetHandlers(std::function<bool()> gently, std::function<void()> at_once) {
  absl::MutexLock lock(&mutex_);
  gently_ = std::move(gently);
  at_once_ = std::move(at_once);
}

void Interrupts::ClearHandlers() {
  absl::MutexLock lock(&mutex_);
  mutex_.Await(absl::Condition(
      +[](bool* running) { return !*running; }, &running_));
  gently_ = nullptr;
  at_once_ = nullptr;
}

int Interrupts::signal() const {
  absl::MutexLock lock(&mutex_);
  return signal_;
}

void Interrupts::YieldToHandler() {
  absl::MutexLock lock(&mutex_);
  mutex_.Await(absl::Condition(
      +[](bool* running) { return !*running; }, &running_));
}

void Interrupts::Exit(int signal) { _exit(128 + signal); }

void Interrupts::Run() {
  const sigset_t set = Waited();
  for (;;) {
    int got = 0;
    if (sigwait(&set, &got) != 0) continue;
    absl::MutexLock lock(&mutex_);
    if (got == SIGUSR1) {
      if (stop_) return;
      continue;
    }
    const bool first = signal_ == 0;
    signal_ = got;
    if (!first || gently_ == nullptr) {
      if (at_once_ != nullptr) at_once_();
      Exit(got);
    }
    running_ = true;
    std::thread([this, gently = gently_, got] {
      if (gently()) Exit(got);
      absl::MutexLock done(&mutex_);
      running_ = false;
    }).detach();
  }
}

void UnblockSignalsInChild() {
  const sigset_t set = Waited();
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
  ::signal(SIGPIPE, SIG_DFL);
}

}  // namespace ndmap::cli
