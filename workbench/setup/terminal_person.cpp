// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/terminal_person.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include <array>
#include <cstdio>

#include "base/text.hpp"
#include "workbench/live/terminal.hpp"

namespace loopwarden::workbench::setup {

TerminalPerson::TerminalPerson()
    : terminal_(is_terminal(STDIN_FILENO) && is_terminal(STDOUT_FILENO)) {
  watch_interrupts();
}

void TerminalPerson::say(const std::string& text) {
  fmt::print("{}\n", text);
  std::fflush(stdout);
}

std::optional<std::string> TerminalPerson::line(const std::string& prompt) {
  constexpr int kBetweenLooks_ms = 200;
  fmt::print("{}", prompt);
  std::fflush(stdout);
  for (;;) {
    if (const std::size_t end = received_.find('\n'); end != std::string::npos) {
      const std::string text = received_.substr(0, end);
      received_.erase(0, end + 1);
      if (!terminal_) fmt::print("{}\n", text);
      return std::string(base::trimmed(text));
    }
    if (interrupted()) return std::nullopt;
    pollfd waiting{STDIN_FILENO, POLLIN, 0};
    if (::poll(&waiting, 1, kBetweenLooks_ms) <= 0) continue;
    std::array<char, 512> bytes{};
    const ssize_t count = ::read(STDIN_FILENO, bytes.data(), bytes.size());
    if (count <= 0) return std::nullopt;
    received_.append(bytes.data(), static_cast<std::size_t>(count));
  }
}

void TerminalPerson::watch_keys(bool on) {
  if (!terminal_ || on == keys_) return;
  if (on) {
    tcgetattr(STDIN_FILENO, &before_);
    termios raw = before_;
    raw.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
    // Any key ends a step. So keys must not stop or kill this process while the valve is moved.
    raw.c_iflag &= ~static_cast<tcflag_t>(IXON);
    raw.c_cc[VQUIT] = raw.c_cc[VSUSP] = _POSIX_VDISABLE;
    raw.c_cc[VMIN] = 0;
    raw.c_cc[VTIME] = 0;
    // Keys that were pressed earlier do not abort.
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &raw);
    received_.clear();
  } else {
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_);
  }
  keys_ = on;
}

std::optional<char> TerminalPerson::key(std::chrono::milliseconds patience) {
  if (!keys_) return std::nullopt;
  pollfd waiting{STDIN_FILENO, POLLIN, 0};
  if (::poll(&waiting, 1, static_cast<int>(patience.count())) <= 0) return std::nullopt;
  char pressed = 0;
  // A terminal that is gone counts as a key, because a key can't be pressed any more.
  return ::read(STDIN_FILENO, &pressed, 1) == 1 ? pressed : '\0';
}

}  // namespace loopwarden::workbench::setup
