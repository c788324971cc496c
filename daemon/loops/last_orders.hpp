// SPDX-License-Identifier: Apache-2.0
// Stores the last commanded mode and set point of each loop for the next start, in a small text
// file of one checksum and one JSON object that is always replaced as a whole.
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

struct LastOrder {
  control::Mode mode = control::Mode::manual;  // manual or automatic
  double set_point = 0.0;                      // PV units
  // Meaning of the set point.
  std::string pv_unit{};
  std::pair<double, double> pv_range{};
  bool commissioned = false;        // somebody commissioned the loop
  bool manual_after_fault = false;  // a fault was there that ends in manual

  friend bool operator==(const LastOrder&, const LastOrder&) = default;
};

struct LastOrders {
  std::map<std::string, LastOrder> loops;  // by tag
  bool known = false;                      // there was a file, and it was sound
  // Why a file that was there is not used; empty: it is, or there was none.
  std::string damaged;
};

std::string text_of(const std::map<std::string, LastOrder>& loops);
// Throws std::runtime_error for a text that is damaged, or of another version.
std::map<std::string, LastOrder> read_last_orders(std::string_view text);

class LastOrdersFile {
 public:
  explicit LastOrdersFile(std::filesystem::path path) : path_(std::move(path)) {}

  // A damaged file is kept as PATH.damaged.
  LastOrders load() const;
  // Waits for the disk. Returns what failed; empty: nothing.
  std::string save(const std::map<std::string, LastOrder>& loops) const;

 private:
  std::filesystem::path path_;
};

}  // namespace loopwarden::daemon
