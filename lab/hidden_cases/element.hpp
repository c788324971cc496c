// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

// The true loop as a chain of physical parts from the controller output to the flow. All parts are
// integrated at 1 ms. Stem and pressure are in controller output units (0 to 10), and so are
// forces, because they are divided by the spring's stiffness.
namespace loopwarden::hidden_cases {

inline constexpr double kStep_s = 1e-3;

class Element {
 public:
  Element() = default;
  Element(const Element&) = delete;
  Element& operator=(const Element&) = delete;
  virtual ~Element() = default;

  // Sets the rest state for a constant input; returns the output.
  virtual double reset(double input) = 0;
  // Runs one step of 1 ms; `time_s` counts from the start of the record, negative before it.
  virtual double step(double input, double time_s) = 0;
};

using Chain = std::vector<std::unique_ptr<Element>>;

double reset(Chain& chain, double input);
double step(Chain& chain, double input, double time_s);

using Intervals = std::vector<std::pair<double, double>>;

// --- Valve ---------------------------------------------------------------------------------------

// x' = (u - x) / lag. Also used for the process and a slow transmitter.
std::unique_ptr<Element> make_lag(double lag_s);

// Positioner with actuator: x'' = w^2 (u - x) - 2 z w x', with a third pole if lag_s > 0.
std::unique_ptr<Element> make_positioner(double natural_frequency_rad_s, double damping,
                                         double lag_s);

// Actuator pressure with insufficient air supply; p never exceeds `supply`: p' = (u - p) / lag
// within -vent to fill. If `choked`, filling slows down near the supply pressure: at most 2 fill
// (supply - p) / supply.
struct AirSupply {
  double fill_per_s;
  double vent_per_s;
  double supply;
  double lag_s;
  bool choked = false;
};
std::unique_ptr<Element> make_air_supply(const AirSupply& air);

// Stem under spring, packing and viscous friction (all divided by the spring's stiffness):
//   x'' / w^2 = u - x - F(x') - d x'
// Friction while it moves: F = sgn(x') (dynamic + (static - dynamic) exp(-(x'/vs)^2)), with the
// exponential (Stribeck) only if vs > 0. At rest the stem holds up to `static_friction` (Karnopp
// 1985). In terms of the (S, J) laws: s = static + dynamic, j = static - dynamic. `gripped`:
// intervals with friction; empty: always.
struct Stem {
  double static_friction;
  double dynamic_friction;
  double stribeck_per_s;
  double frequency_rad_s;
  double damping_s;
  Intervals gripped;
  // Ratio of the friction downwards to that upwards; Karnopp stem only.
  double closing_friction = 1.0;
};
std::unique_ptr<Element> make_karnopp_stem(Stem stem);

// The same stem with the bristles of Canudas de Wit et al. (1995): z' = v - |v| z / g(v),
// F = k z + c z', g = (dynamic + (static - dynamic) exp(-(v/vs)^2)) / k.
std::unique_ptr<Element> make_lugre_stem(const Stem& stem, double bristle_stiffness);

// Linkage play of `width` between stem and plug. A side in contact moves the plug with a
// first-order lag.
std::unique_ptr<Element> make_linkage_play(double width, double contact_lag_s);

// Bouc (1967) and Wen (1976): output u - width h / 2,
// h' = u' (1 - |h|^n (g sgn(u' h) + 1 - g)) / a.
struct BoucWen {
  double width;
  double scale;
  double exponent;
  double shape;
};
std::unique_ptr<Element> make_bouc_wen(const BoucWen& hysteresis);

// Prandtl and Ishlinskii: sum of weight times play of the given half widths; the weights sum to 1.
struct PlayStack {
  std::vector<double> half_widths;
  std::vector<double> weights;
};
std::unique_ptr<Element> make_play_stack(PlayStack stack);

// A stepping drive: moves by whole steps of `step`, one per `pulse_s`, if the input is more than
// half a step plus `margin` of a step away.
std::unique_ptr<Element> make_stepping_drive(double step, double margin, double pulse_s);

// Any curve without memory: characteristic, leakage, positioner with a grid of positions.
std::unique_ptr<Element> make_curve(std::function<double(double)> curve);

// `before` until `at_s`, then `after`, which starts at rest with the input of that time.
std::unique_ptr<Element> make_onset(Chain before, Chain after, double at_s);

// --- Process -------------------------------------------------------------------------------------

// Gain as a function of time: y = gain(t) v.
std::unique_ptr<Element> make_gain(std::function<double(double)> gain_at);

std::unique_ptr<Element> make_dead_time(double dead_time_s);

// Plug flow: the outflow entered one pipe volume earlier; dead time = volume / flow, flow = input.
std::unique_ptr<Element> make_plug_flow(double volume);

// Lag with different time constants up and down.
std::unique_ptr<Element> make_two_way_lag(double up_s, double down_s);

// (1 - beta s) / ((lag s + 1)(second s + 1)): starts in the wrong direction.
std::unique_ptr<Element> make_inverse_response(double beta_s, double lag_s, double second_lag_s);

// Two opposing paths, the weaker one faster: y = (1 + g) y1 - g y2, y1 with lag `slow_s`, y2 with
// lag `fast_s`.
std::unique_ptr<Element> make_opposing_lags(double weaker_gain, double slow_s, double fast_s);

// Two connected tanks: v' = w^2 (u - h) - 2 z w v (1 + |v| / v0), h' = v.
std::unique_ptr<Element> make_connected_tanks(double natural_frequency_rad_s, double damping,
                                              double turbulent_per_s);

// y = (1 - share) x + share y(t - delay): part of the output returns to the input.
std::unique_ptr<Element> make_recycle(double share, double delay_s);

// A share of the response passes an additional, much slower lag.
std::unique_ptr<Element> make_slow_tail(double share, double lag_s);

}  // namespace loopwarden::hidden_cases
