// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/progress.h"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "absl/strings/str_cat.h"
#include "absl/strings/str_format.h"
#include "absl/time/clock.h"
#include "client/cli/text.h"

namespace ndmap::cli {

namespace {

// A longer line would wrap, and could not be erased.
size_t Columns(std::FILE* out) {
  winsize size{};
  return ioctl(fileno(out), TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

}  // namespace

std::string Bar(double fraction, int width) {
  const int inside = std::max(1, width - 2);
  const int full = static_cast<int>(std::lround(std::clamp(fraction, 0.0, 1.0) * inside));
  return absl::StrCat("[", std::string(full, '#'), std::string(inside - full, '.'), "]");
}

Progress::Progress(std::FILE* out, bool terminal, bool quiet)
    : out_(out), terminal_(terminal), quiet_(quiet) {}

bool Progress::IsTerminal(std::FILE* out) { return isatty(fileno(out)) == 1; }

void Progress::Begin(absl::string_view step) {
  absl::MutexLock lock(&mutex_);
  busy_ = true;
  step_ = std::string(step);
  detail_.clear();
  fraction_ = -1;
  begun_ = absl::Now();
  Draw();
}

void Progress::Update(double fraction, absl::string_view detail) {
  absl::MutexLock lock(&mutex_);
  fraction_ = fraction;
  detail_ = std::string(detail);
  if (busy_ && absl::Now() - drawn_ >= absl::Milliseconds(100)) Draw();
}

void Progress::End(absl::string_view detail, double seconds) {
  absl::MutexLock lock(&mutex_);
  if (!busy_) return;
  Erase();
  busy_ = false;
  if (quiet_) return;
  if (seconds < 0) seconds = absl::ToDoubleSeconds(absl::Now() - begun_);
  absl::FPrintF(out_, "%-16s %8s  %s\n", step_, FormatSeconds(seconds), detail);
  std::fflush(out_);
}

void Progress::Abandon() {
  absl::MutexLock lock(&mutex_);
  Erase();
  busy_ = false;
}

void Progress::Note(absl::string_view line) {
  absl::MutexLock lock(&mutex_);
  Erase();
  absl::FPrintF(out_, "%s\n", line);
  Draw();
}

void Progress::Draw() {
  if (!terminal_ || quiet_ || !busy_) return;
  drawn_ = absl::Now();
  const std::string bar = fraction_ < 0 ? std::string(24, ' ') : Bar(fraction_, 24);
  const std::string line = absl::StrFormat(
      "%-16s %8s  %s %s", step_, FormatSeconds(absl::ToDoubleSeconds(drawn_ - begun_)), bar, detail_);
  absl::FPrintF(out_, "\r\x1b[K%s", line.substr(0, Columns(out_) - 1));
  std::fflush(out_);
}

void Progress::Erase() {
  if (!terminal_ || quiet_ || !busy_) return;
  absl::FPrintF(out_, "\r\x1b[K");
  std::fflush(out_);
}

}  // namespace ndmap::cli
