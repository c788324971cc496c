// SPDX-License-Identifier: Apache-2.0
#include "model/specialist/fit/network_inputs.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::specialist {
namespace {

using X = FaultModel;

constexpr double kLeast = 1e-9;  // of a mean square, (% of span)^2

double log_ratio(double a, double b) noexcept { return std::log((a + kLeast) / (b + kLeast)); }
double bounded(double x) noexcept { return std::isfinite(x) ? std::clamp(x, -8.0, 8.0) : 0.0; }

template <X x>
double misfit(const WindowFits& f) noexcept {
  return log_ratio(f.of(x).mse, f.noise * f.noise);
}
template <X x>
double innovation(const WindowFits& f) noexcept {
  return log_ratio(f.of(x).innovation, f.noise * f.noise);
}
template <X x>
double over_healthy(const WindowFits& f) noexcept {
  return log_ratio(f.of(x).mse, f.of(X::healthy).mse);
}
template <X x>
double innovation_over_healthy(const WindowFits& f) noexcept {
  return log_ratio(f.of(x).innovation, f.of(X::healthy).innovation);
}
template <X x, X y>
double over(const WindowFits& f) noexcept {
  return 2.0 * log_ratio(f.of(x).mse, f.of(y).mse);
}
template <X x>
double log_size(const WindowFits& f) noexcept {
  return std::log(f.of(x).size + 0.1);
}
double offset_size(const WindowFits& f) noexcept { return f.of(X::hysteresis_offset).size / 2.0; }
double jump(const WindowFits& f) noexcept { return 4.0 * f.of(X::stiction).shape; }
double knee(const WindowFits& f) noexcept { return 2.0 * f.of(X::hysteresis_width).shape; }
double low_air_rate(const WindowFits& f) noexcept {
  return std::log(f.of(X::low_air_supply).shape);
}
double low_air_limit(const WindowFits& f) noexcept {
  return log_ratio(f.of(X::low_air_supply).limit + 0.1, f.co_range + 0.1);
}
template <X x>
double gain_off(const WindowFits& f) noexcept {
  return f.of(x).gain_off;
}
template <X x>
double dead_time_off(const WindowFits& f) noexcept {
  return f.of(x).dead_time_off;
}
template <X x>
double lag_off(const WindowFits& f) noexcept {
  return f.of(x).lag_off;
}
double co_range(const WindowFits& f) noexcept { return std::log(f.co_range / f.noise); }
double pv_range(const WindowFits& f) noexcept { return std::log(f.pv_range / f.noise); }
double co_travel(const WindowFits& f) noexcept {
  return log_ratio(f.co_travel + 0.1, f.co_range + 0.1);
}
double co_fastest(const WindowFits& f) noexcept { return std::log(f.co_fastest + 0.05); }
double co_reversals(const WindowFits& f) noexcept { return std::log1p(f.reversals); }

struct Measure {
  std::string_view name;
  double (*of)(const WindowFits&) noexcept;
};

constexpr std::array kMeasures{
    // error of each fault model over the noise
    Measure{"healthy_misfit", misfit<X::healthy>},
    Measure{"healthy_innovation", innovation<X::healthy>},
    Measure{"other_process_misfit", misfit<X::other_process>},
    Measure{"other_process_innovation", innovation<X::other_process>},
    Measure{"backlash_misfit", misfit<X::backlash>},
    Measure{"backlash_innovation", innovation<X::backlash>},
    Measure{"stiction_misfit", misfit<X::stiction>},
    Measure{"stiction_innovation", innovation<X::stiction>},
    Measure{"width_misfit", misfit<X::hysteresis_width>},
    Measure{"width_innovation", innovation<X::hysteresis_width>},
    Measure{"offset_misfit", misfit<X::hysteresis_offset>},
    Measure{"offset_innovation", innovation<X::hysteresis_offset>},
    Measure{"low_air_misfit", misfit<X::low_air_supply>},
    Measure{"low_air_innovation", innovation<X::low_air_supply>},
    // over the healthy valve's
    Measure{"other_process_over_healthy", over_healthy<X::other_process>},
    Measure{"other_process_innovation_over_healthy", innovation_over_healthy<X::other_process>},
    Measure{"backlash_over_healthy", over_healthy<X::backlash>},
    Measure{"backlash_innovation_over_healthy", innovation_over_healthy<X::backlash>},
    Measure{"stiction_over_healthy", over_healthy<X::stiction>},
    Measure{"stiction_innovation_over_healthy", innovation_over_healthy<X::stiction>},
    Measure{"width_over_healthy", over_healthy<X::hysteresis_width>},
    Measure{"width_innovation_over_healthy", innovation_over_healthy<X::hysteresis_width>},
    Measure{"offset_over_healthy", over_healthy<X::hysteresis_offset>},
    Measure{"offset_innovation_over_healthy", innovation_over_healthy<X::hysteresis_offset>},
    Measure{"low_air_over_healthy", over_healthy<X::low_air_supply>},
    Measure{"low_air_innovation_over_healthy", innovation_over_healthy<X::low_air_supply>},
    // of faults over each other, and their sizes
    Measure{"backlash_size", log_size<X::backlash>},
    Measure{"stiction_over_backlash", over<X::stiction, X::backlash>},
    Measure{"stiction_size", log_size<X::stiction>},
    Measure{"width_over_backlash", over<X::hysteresis_width, X::backlash>},
    Measure{"width_over_stiction", over<X::hysteresis_width, X::stiction>},
    Measure{"width_size", log_size<X::hysteresis_width>},
    Measure{"low_air_over_backlash", over<X::low_air_supply, X::backlash>},
    Measure{"low_air_over_stiction", over<X::low_air_supply, X::stiction>},
    Measure{"low_air_over_width", over<X::low_air_supply, X::hysteresis_width>},
    Measure{"low_air_size", log_size<X::low_air_supply>}, Measure{"offset_size", offset_size},
    // forms
    Measure{"stiction_jump", jump}, Measure{"width_knee", knee},
    Measure{"low_air_rate", low_air_rate}, Measure{"low_air_limit", low_air_limit},
    // error of the assumed process
    Measure{"healthy_gain_off", gain_off<X::healthy>},
    Measure{"healthy_dead_time_off", dead_time_off<X::healthy>},
    Measure{"healthy_lag_off", lag_off<X::healthy>},
    Measure{"other_process_gain_off", gain_off<X::other_process>},
    Measure{"other_process_dead_time_off", dead_time_off<X::other_process>},
    Measure{"other_process_lag_off", lag_off<X::other_process>},
    // movement
    Measure{"co_range_over_noise", co_range}, Measure{"pv_range_over_noise", pv_range},
    Measure{"co_travel_over_range", co_travel}, Measure{"co_fastest", co_fastest},
    Measure{"co_reversals", co_reversals}};
static_assert(kMeasures.size() == kNetworkInputs);

}  // namespace

std::string_view input_name(std::size_t place) noexcept { return kMeasures[place].name; }

NetworkInputs network_inputs_of(const WindowFits& found) noexcept {
  NetworkInputs inputs{};
  for (std::size_t i = 0; i < kNetworkInputs; ++i) inputs[i] = bounded(kMeasures[i].of(found));
  return inputs;
}

}  // namespace loopwarden::specialist
