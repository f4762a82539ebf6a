// SPDX-License-Identifier: GPL-3.0-or-later
// Keys from a terminal, each as it is pressed, or characters from a pipe or file.
#pragma once

#include <termios.h>

#include <optional>

#include "client/cli/interrupt.h"

namespace ndmap::cli {

// While it lives, a terminal at the descriptor gives keys at once and does not show them. However the program
// ends, by a signal that `interrupts` handles too, the terminal is put back as it was.
class KeyReader {
 public:
  KeyReader(int descriptor, Interrupts& interrupts);
  ~KeyReader();
  KeyReader(const KeyReader&) = delete;
  KeyReader& operator=(const KeyReader&) = delete;

  bool terminal() const { return terminal_; }
  // The next key; nothing at the end of input, which ctrl-D is on a terminal.
  std::optional<char> Next();

 private:
  void Restore();

  const int descriptor_;
  Interrupts& interrupts_;
  bool terminal_ = false;
  termios before_{};
};

}  // namespace ndmap::cli
