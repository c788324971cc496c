// SPDX-License-Identifier: Apache-2.0
// The relay experiment: ultimate gain and period of a loop, without a model.
//
//   u = u0 + d where PV is below target - eps, u0 - d where it is above target + eps   (reverse action)
//   Ku = 4 d / (pi sqrt(a^2 - eps^2)),  Tu the period, a half of what PV goes through in a period
//
//   u, u0, d  CO units     PV, a, eps  PV units     Ku  CO units / PV unit     Tu  s
//
// It ends when two periods in a row agree within 5 % in length and size, at the earliest after three.
// Settings from it (PI): Tyreus and Luyben kp = Ku/3.2, Ti = 2.2 Tu; Ziegler and Nichols kp = 0.45 Ku,
// Ti = Tu/1.2. Both scale with the process's gain.
//
// Limits: Ku is by the describing function, 5 to 20 % off where dead time is long; a sticking
// valve adds its own band to the relay's, and shows as a Tu that falls with d.
//
// Sources: Åström and Hägglund, Automatica 20 (1984) 645-651; Tyreus and Luyben, Ind. Eng. Chem. Res. 31
// (1992) 2625-2628.
#pragma once

#include <cstddef>
#include <optional>

#include "model/control/pid.hpp"

namespace loopwarden::analysis {

struct RelaySettings {
  double output = 0.0;      // u0, CO units
  double amplitude = 0.0;   // d, CO units, > 0
  double target = 0.0;      // PV units
  double hysteresis = 0.0;  // eps, PV units, above PV's noise
  control::Action action = control::Action::reverse;
};

struct RelayResult {
  double ultimate_gain = 0.0;      // Ku
  double ultimate_period_s = 0.0;  // Tu
  double amplitude = 0.0;          // a, PV units
  int periods = 0;

  control::PidGains tyreus_luyben() const;
  control::PidGains ziegler_nichols() const;
};

class RelayTest {
 public:
  explicit RelayTest(const RelaySettings& settings) : settings_(settings) {}

  // The output for the next period.
  double step(double time_s, double pv);
  const std::optional<RelayResult>& result() const { return result_; }

 private:
  void end_period(double time_s);

  RelaySettings settings_;
  int side_ = 1;
  bool started_ = false;
  double period_began_s_ = 0.0;
  double low_ = 0.0;  // PV units, of the present period
  double high_ = 0.0;
  double last_period_s_ = 0.0;
  double last_amplitude_ = 0.0;
  int periods_ = 0;
  std::optional<RelayResult> result_;
};

}  // namespace loopwarden::analysis
