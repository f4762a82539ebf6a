// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/key_reader.h"

#include <unistd.h>

#include <cerrno>

namespace ndmap::cli {
namespace {

constexpr char kEndOfTransmission = 4;  // ctrl-D

}  // namespace

KeyReader::KeyReader(int descriptor, Interrupts& interrupts)
    : descriptor_(descriptor), interrupts_(interrupts) {
  if (tcgetattr(descriptor, &before_) != 0) return;
  terminal_ = true;
  // Before the terminal is changed: a signal in between restores what needs no restoring.
  interrupts_.SetHandlers(
      [this] {
        Restore();
        return true;
      },
      [this] { Restore(); });
  termios keys = before_;
  // Ctrl-C stays a signal.
  keys.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  keys.c_cc[VMIN] = 1;
  keys.c_cc[VTIME] = 0;
  tcsetattr(descriptor, TCSANOW, &keys);
}

KeyReader::~KeyReader() {
  if (!terminal_) return;
  Restore();
  interrupts_.ClearHandlers();
}

void KeyReader::Restore() { tcsetattr(descriptor_, TCSANOW, &before_); }

std::optional<char> KeyReader::Next() {
  char key = 0;
  ssize_t got = 0;
  do {
    got = read(descriptor_, &key, 1);
  } while (got < 0 && errno == EINTR);
  if (got != 1 || (terminal_ && key == kEndOfTransmission)) return std::nullopt;
  return key;
}

}  // namespace ndmap::cli
