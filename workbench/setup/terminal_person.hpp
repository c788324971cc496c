// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <termios.h>

#include <string>

#include "workbench/setup/dialogue.hpp"

namespace loopwarden::workbench::setup {

// The person who uses standard input and output.
class TerminalPerson final : public Person {
 public:
  TerminalPerson();
  TerminalPerson(const TerminalPerson&) = delete;
  TerminalPerson& operator=(const TerminalPerson&) = delete;
  ~TerminalPerson() override { watch_keys(false); }

  void say(const std::string& text) override;
  std::optional<std::string> line(const std::string& prompt) override;
  bool has_keys() const override { return terminal_; }
  void watch_keys(bool on) override;
  std::optional<char> key(std::chrono::milliseconds patience) override;

 private:
  bool terminal_;
  bool keys_ = false;
  termios before_{};
  std::string received_;
};

}  // namespace loopwarden::workbench::setup
