// SPDX-License-Identifier: Apache-2.0
#include "services/page/app/ask_unseen.hpp"

#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

#include <cstdio>
#include <iostream>
#include <stdexcept>

namespace loopwarden::page {
namespace {

// Turns off the terminal's echo during its lifetime.
class Silence {
 public:
  Silence() {
    if (::tcgetattr(STDIN_FILENO, &before_) != 0) return;
    termios quiet = before_;
    quiet.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    silent_ = ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &quiet) == 0;
  }
  Silence(const Silence&) = delete;
  Silence& operator=(const Silence&) = delete;
  ~Silence() {
    if (silent_) ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
  }

 private:
  termios before_{};
  bool silent_ = false;
};

}  // namespace

std::string ask_unseen(const char* prompt) {
  if (::isatty(STDIN_FILENO) == 0) throw std::runtime_error("no terminal to ask at; --stdin?");
  const Silence silence;
  fmt::print(stderr, "{}", prompt);
  std::string line;
  std::getline(std::cin, line);
  fmt::print(stderr, "\n");
  return line;
}

}  // namespace loopwarden::page
