// SPDX-License-Identifier: Apache-2.0
// Whether it was a device's watchdog that moved the valve while no command came.
#pragma once

#include <optional>
#include <string>

namespace loopwarden::workbench::setup {

class Silence {
 public:
  struct Settings {
    double before;     // where the value that is watched stood: read-back, or PV
    double least;      // change that counts, in the same unit
    double written_s;  // so long after the last order it is still written
    double timeout_s;  // of the device's watchdog
  };
  explicit Silence(const Settings& settings) : settings_(settings) {}

  // NaN: nothing tells.
  void see(double time_s, double value) noexcept;  // since the last order
  // Of the move that lasted to the end.
  std::optional<double> moved_after_s() const noexcept { return away_since_s_; }
  // Why that shows no watchdog; empty: it does.
  std::string why_not() const;

 private:
  Settings settings_;
  double seen_s_ = 0.0;
  bool told_ = false;  // by the newest value
  std::optional<double> away_since_s_;
};

}  // namespace loopwarden::workbench::setup
