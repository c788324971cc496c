// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <string>

namespace loopwarden::workbench {

// Shows the progress of long work on standard error: a bar on a terminal, lines in the background.
// In all other cases it prints no output.
class Progress {
 public:
  using Clock = std::chrono::steady_clock::time_point (*)();

  Progress(std::string what, std::uint64_t total, Clock now = std::chrono::steady_clock::now);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();

  void update(std::uint64_t done);
  // `share` of the total, 0 to 1.
  void update_share(double share);

 private:
  void tell(std::uint64_t done);

  std::string what_;
  std::uint64_t total_;
  Clock now_;
  bool visible_;
  bool drawn_ = false;
  int told_percent_ = -1;
  std::chrono::steady_clock::time_point started_;
  std::chrono::steady_clock::time_point drawn_at_;
};

// Announces a long record, because the user could take the silence for a hang.
void say_if_long(const std::string& record, std::size_t rows);

}  // namespace loopwarden::workbench
