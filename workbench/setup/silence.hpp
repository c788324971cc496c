// SPDX-License-Identifier: Apache-2.0
// Decides whether the device's watchdog moved the valve while the daemon sent no commands.
#pragma once

#include <optional>
#include <string>

namespace loopwarden::workbench::setup {

class Silence {
 public:
  struct Settings {
    double before;     // earlier value of the observed signal: read-back, or PV
    double least;      // smallest change that counts, in the same unit
    double written_s;  // time for which the last command is still written
    double timeout_s;  // of the device's watchdog
  };
  explicit Silence(const Settings& settings) : settings_(settings) {}

  // Adds a value, with the time since the last command. NaN: no valid value.
  void see(double time_s, double value) noexcept;
  // Returns the start of the move that lasted to the end, in s after the last command.
  std::optional<double> moved_after_s() const noexcept { return away_since_s_; }
  // Returns why this is no evidence of a watchdog; empty: it is.
  std::string why_not() const;

 private:
  Settings settings_;
  double seen_s_ = 0.0;
  bool told_ = false;  // the newest value was valid
  std::optional<double> away_since_s_;
};

}  // namespace loopwarden::workbench::setup
