// SPDX-License-Identifier: Apache-2.0
// Controller settings for a process with gain K, time constant T and dead time L, by named rules.
//
//   rule        PI                                             PID
//   zn-thesis   kp = 0.9 T/L, Ti = L/0.3                       -
//   zn          kp = 0.9 T/(K L), Ti = L/0.3                   kp = 1.2 T/(K L), Ti = 2 L, Td = L/2
//   cohen-coon  kp = (T/(K L)) (0.9 + L/(12 T)),               kp = (T/(K L)) (4/3 + L/(4 T)),
//               Ti = L (30 + 3 L/T)/(9 + 20 L/T)               Ti = L (32 + 6 L/T)/(13 + 8 L/T),
//                                                              Td = 4 L/(11 + 2 L/T)
//   lambda      kp = T/(K (lambda + L)), Ti = T                kp = (T + L/2)/(K (lambda + L/2)),
//                                                              Ti = T + L/2, Td = T L/(2 T + L)
//   simc        kp = T/(K (tc + L)), Ti = min(T, 4 (tc + L))   -
//   amigo       kp = 0.15/K + (0.35 - L T/(L + T)^2) T/(K L),  kp = (0.2 + 0.45 T/L)/K,
//               Ti = 0.35 L + 13 L T^2/(T^2 + 12 L T + 7 L^2)  Ti = L (0.4 L + 0.8 T)/(L + 0.1 T),
//                                                              Td = 0.5 L T/(0.3 L + T)
//
//   integrating PI                                             PID
//   zn          kp = 0.9/(K L), Ti = L/0.3                     kp = 1.2/(K L), Ti = 2 L, Td = L/2
//   lambda      kp = (2 lambda + L)/(K (lambda + L)^2),        -
//               Ti = 2 lambda + L
//   simc        kp = 1/(K (tc + L)), Ti = 4 (tc + L)           -
//   amigo       kp = 0.35/(K L), Ti = 13.4 L                   kp = 0.45/(K L), Ti = 8 L, Td = L/2
//
//   K   PV units / CO unit (integrating: / (CO unit s)), not 0     T, L, Ti, Td  s
//   kp  CO units / PV unit           ki = kp/Ti, kd = kp Td; derivative filtered with Td/10
//   lambda, tc  closed-loop time constant, s     -  the rule has no such form
//
// A second lag is divided by the half rule before any rule is used: half of the smaller lag is
// added to L, half to the larger lag. The default of lambda is the larger of T and L, or 3 L if
// integrating; tc of simc is L. Gains are those for |K|; the action of the controller has the sign.
//
// zn-thesis is the computation of the thesis for plant 1 (0.9 * 1.78/2.62 = 0.611, 0.611 * 0.3/2.62
// = 0.0700): the rule of Ziegler and Nichols without the process gain. It suits only gains near 1;
// twice the gain makes the loop twice as fast or unstable. scales_with_gain() is false for it.
//
// Errors: the result is empty if T or K is 0, or if L is 0 and the rule needs a dead time. It is
// also empty if the rule doesn't have the form.
// Limits: the rules ignore friction.
//
// Sources: Ziegler and Nichols, Trans. ASME 64 (1942); Cohen and Coon, Trans. ASME 75 (1953);
// Rivera, Morari and Skogestad, Ind. Eng. Chem. Process Des. Dev. 25 (1986) (lambda); Skogestad, J.
// Process Control 13 (2003) (simc, half rule); Chien and Fruehauf, Chem. Eng. Prog. 86 (1990)
// (lambda, integrating); Åström and Hägglund, Advanced PID Control (2006), ch. 7 (amigo); Sewdass,
// thesis, section 6.3.2 (zn-thesis).
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "model/control/tuning.hpp"
#include "model/plant/process.hpp"

namespace loopwarden::analysis {

enum class TuningRule : std::uint8_t { zn_thesis, zn, cohen_coon, lambda, simc, amigo };
enum class ControllerForm : std::uint8_t { pi, pid };

inline constexpr std::array kTuningRules{TuningRule::zn_thesis,  TuningRule::zn,
                                         TuningRule::cohen_coon, TuningRule::lambda,
                                         TuningRule::simc,       TuningRule::amigo};

const char* to_text(TuningRule rule) noexcept;
// Returns whether c times the process gain leads to 1/c of the controller gains.
constexpr bool scales_with_gain(TuningRule rule) noexcept { return rule != TuningRule::zn_thesis; }

struct TuningOptions {
  ControllerForm form = ControllerForm::pi;
  std::optional<double> lambda_s{};  // s, > 0
};

// Returns the gains by a rule.
std::optional<control::PidGains> tune(TuningRule rule, const plant::ProcessParameters& process,
                                      const TuningOptions& options = {});

}  // namespace loopwarden::analysis
