// SPDX-License-Identifier: Apache-2.0
// Stores the last commanded mode and set point of each loop for the next start. The file is a small
// text file of one checksum and one JSON object, always replaced as a whole.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <utility>

#include "model/control/loop_controller.hpp"

namespace loopwarden::daemon {

struct LastCommand {
  control::Mode mode = control::Mode::manual;  // manual or automatic
  double set_point = 0.0;                      // PV units
  // Unit and range in which the set point is valid.
  std::string pv_unit{};
  std::pair<double, double> pv_range{};
  bool commissioned = false;        // the loop was being commissioned
  bool manual_after_fault = false;  // the loop had a fault that ends in manual

  friend bool operator==(const LastCommand&, const LastCommand&) = default;
};

struct LastCommands {
  std::map<std::string, LastCommand> loops;  // by tag
  bool known = false;                        // the file existed and was valid
  // Why an existing file is not used; empty: it is used, or there was no file.
  std::string damaged;
};

std::string text_of(const std::map<std::string, LastCommand>& loops);
// Throws std::runtime_error if the text is damaged or of another version.
std::map<std::string, LastCommand> read_last_orders(std::string_view text);

class LastCommandsFile {
 public:
  explicit LastCommandsFile(std::filesystem::path path) : path_(std::move(path)) {}

  // Reads the file. A damaged file is kept as PATH.damaged.
  LastCommands load() const;
  // Writes the file and waits for the disk. Returns the error; empty: no error.
  std::string save(const std::map<std::string, LastCommand>& loops) const;

 private:
  std::filesystem::path path_;
};

}  // namespace loopwarden::daemon
