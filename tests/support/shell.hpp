// SPDX-License-Identifier: Apache-2.0
// The output and exit code of a command.
#pragma once

#include <sys/wait.h>

#include <array>
#include <catch2/catch.hpp>
#include <cstddef>
#include <cstdio>
#include <string>

namespace loopwarden::tests {

struct ShellOutcome {
  int exit_code;
  std::string text;  // standard output, and the error output if the line redirects it
};

// Runs the line in the shell of `popen`.
inline ShellOutcome run(const std::string& command) {
  FILE* pipe = popen(command.c_str(), "r");
  REQUIRE(pipe != nullptr);
  std::string text;
  std::array<char, 4096> buffer{};
  for (std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe); n > 0;
       n = std::fread(buffer.data(), 1, buffer.size(), pipe)) {
    text.append(buffer.data(), n);
  }
  const int status = pclose(pipe);
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text};
}

// Runs a line of bash, as users type it. It must not contain '.
inline ShellOutcome bash(const std::string& line) { return run("exec bash -c '" + line + "'"); }

}  // namespace loopwarden::tests
