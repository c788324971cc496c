// SPDX-License-Identifier: Apache-2.0
// Controller settings in the two forms that engineers write, and the conversion between them.
//
// Parallel form (the thesis):   u = kp e + ki ∫ e dt + kd de/dt
// ISA standard form:            u% = kc ( e% + 1/ti ∫ e% dt + td de%/dt )
//
//   e, u       error and controller output in PV and CO units; e%, u% in percent of their spans
//   kp         CO units per PV unit          ki   CO units per PV unit and second
//   kd         CO units · s per PV unit      kc   % of CO span per % of PV span
//   ti, td     s (ti: seconds per repeat; infinity means no integral action)
//
//   kp = kc · (CO span / PV span),   ki = kp / ti,   kd = kp · td
//
// Ranges: kp >= 0, ki >= 0, kd >= 0 (the action sets the direction of the output, never a sign of
// a gain). An ISA form without proportional action (kc = 0) can't be given: it has no ki. Gains
// with kp = 0 have no ISA form: to_isa() loses their ki and kd.
//
// Source: ISA-TR5.9 (2023), PID algorithms; Åström and Hägglund, Advanced PID Control (2006), ch.
// 3.
#pragma once

namespace loopwarden::control {

struct PidGains {
  double kp = 0.0;                   // CO units / PV unit
  double ki = 0.0;                   // CO units / (PV unit s)
  double kd = 0.0;                   // CO units s / PV unit
  double derivative_filter_s = 0.0;  // s, time constant of the first-order filter on the derivative

  friend bool operator==(const PidGains&, const PidGains&) = default;
};

struct IsaTuning {
  double kc = 0.0;                   // % of CO span / % of PV span
  double ti_s = 0.0;                 // s per repeat; infinity: no integral action
  double td_s = 0.0;                 // s
  double derivative_filter_s = 0.0;  // s
};

// Spans in PV and CO units, both > 0.
PidGains from_isa(const IsaTuning& isa, double pv_span, double co_span) noexcept;
IsaTuning to_isa(const PidGains& gains, double pv_span, double co_span) noexcept;

}  // namespace loopwarden::control
