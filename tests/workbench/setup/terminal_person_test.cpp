// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/terminal_person.hpp"

#include <pty.h>
#include <unistd.h>

#include <catch2/catch.hpp>
#include <chrono>
#include <cstdio>
#include <optional>

namespace terminal_person_test {

using loopwarden::workbench::setup::TerminalPerson;

namespace {

// A terminal in place of standard input and output, until it is destroyed.
class OwnTerminal {
 public:
  OwnTerminal() {
    std::fflush(stdout);
    if (::openpty(&keyboard_, &terminal_, nullptr, nullptr, nullptr) != 0) return;
    ::dup2(terminal_, STDIN_FILENO);
    ::dup2(terminal_, STDOUT_FILENO);
  }
  OwnTerminal(const OwnTerminal&) = delete;
  OwnTerminal& operator=(const OwnTerminal&) = delete;
  ~OwnTerminal() {
    std::fflush(stdout);
    ::dup2(input_, STDIN_FILENO);
    ::dup2(output_, STDOUT_FILENO);
    for (const int fd : {input_, output_, keyboard_, terminal_}) ::close(fd);
  }
  bool press(char key) const { return ::write(keyboard_, &key, 1) == 1; }

 private:
  int input_ = ::dup(STDIN_FILENO);
  int output_ = ::dup(STDOUT_FILENO);
  int keyboard_ = -1;
  int terminal_ = -1;
};

// The key that is read after `key` was pressed.
std::optional<char> read_back(char key) {
  const OwnTerminal terminal;
  TerminalPerson person;
  if (!person.has_keys()) return std::nullopt;
  person.watch_keys(true);
  if (!terminal.press(key)) return std::nullopt;
  return person.key(std::chrono::seconds(5));
}

}  // namespace

TEST_CASE("keys that stop or kill a program are ordinary keys while a valve moves", "[setup]") {
  constexpr char kControlBackslash = '\x1c';
  constexpr char kControlZ = '\x1a';
  constexpr char kControlS = '\x13';
  for (const char key : {'x', kControlBackslash, kControlZ, kControlS}) {
    const std::optional<char> read = read_back(key);
    INFO("key " << static_cast<int>(key));
    REQUIRE(read);
    CHECK(*read == key);
  }
}

}  // namespace terminal_person_test
