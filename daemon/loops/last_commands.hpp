// SPDX-License-Identifier: Apache-2.0 The mode and set point that each loop was last ordered to, as
// they are kept for the next start: a small text file of one checksum and one JSON object, replaced
// whole.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "model/control/loop_controller.hpp"

namespace loopwarden::daemon {

struct LastCommand {
  control::Mode mode = control::Mode::manual;  // manual or automatic
  double set_point = 0.0;                      // PV units
  // Meaning of the set point.
  std::string pv_unit{};
  std::pair<double, double> pv_range{};
  bool commissioned = false;        // somebody commissioned the loop
  bool manual_after_fault = false;  // a fault was there that ends in manual

  friend bool operator==(const LastCommand&, const LastCommand&) = default;
};

struct LastCommands {
  std::map<std::string, LastCommand> loops;  // by tag
  bool known = false;                        // there was a file, and it was sound
  // Why a file that was there is not used; empty: it is, or there was none.
  std::string damaged;
};

std::string text_of(const std::map<std::string, LastCommand>& loops);
// Throws std::runtime_error for a text that is damaged, or of another version.
std::map<std::string, LastCommand> read_last_orders(std::string_view text);

class LastCommandsFile {
 public:
  explicit LastCommandsFile(std::filesystem::path path) : path_(std::move(path)) {}

  // A damaged file is kept as PATH.damaged.
  LastCommands load() const;
  // Waits for the disk. Returns what failed; empty: nothing.
  std::string save(const std::map<std::string, LastCommand>& loops) const;

 private:
  std::filesystem::path path_;
};

}  // namespace loopwarden::daemon
