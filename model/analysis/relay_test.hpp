// SPDX-License-Identifier: Apache-2.0
// The relay experiment: measures the ultimate gain and period of a loop without a model.
//
//   u = u0 + d  if PV < target - eps,  u0 - d  if PV > target + eps     (reverse action)
//   Ku = 4 d / (pi sqrt(a^2 - eps^2)),  Tu the period,  a half of the range of PV in a period
//
//   u, u0, d  CO units     PV, a, eps  PV units     Ku  CO units / PV unit     Tu  s
//
// It ends when two successive periods agree within 5 % in length and size, after at least three
// periods. PI settings from the result: Tyreus and Luyben kp = Ku/3.2, Ti = 2.2 Tu; Ziegler and
// Nichols kp = 0.45 Ku, Ti = Tu/1.2. Both scale with the gain of the process.
//
// Limits: Ku follows from the describing function, with an error of 5 to 20 % if the dead time is
// long. A sticking valve adds its band to that of the relay; its sign is a Tu that falls with d.
//
// Sources: Åström and Hägglund, Automatica 20 (1984) 645-651; Tyreus and Luyben, Ind. Eng. Chem.
// Res. 31 (1992) 2625-2628.
#pragma once

#include <optional>

#include "model/control/pid.hpp"

namespace loopwarden::analysis {

struct RelaySettings {
  double output = 0.0;      // u0, CO units
  double amplitude = 0.0;   // d, CO units, > 0
  double target = 0.0;      // PV units
  double hysteresis = 0.0;  // eps, PV units, above the noise of PV
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

  // Steps one period with the measured `pv`, PV units, and returns the output for the next period,
  // CO units.
  double step(double time_s, double pv);
  const std::optional<RelayResult>& result() const { return result_; }

 private:
  void end_period(double time_s);

  RelaySettings settings_;
  int side_ = 1;
  bool started_ = false;
  double period_began_s_ = 0.0;
  double low_ = 0.0;  // PV units, in the present period
  double high_ = 0.0;
  double last_period_s_ = 0.0;
  double last_amplitude_ = 0.0;
  int periods_ = 0;
  std::optional<RelayResult> result_;
};

}  // namespace loopwarden::analysis
