// SPDX-License-Identifier: Apache-2.0
#include "model/analysis/tuning_rules.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/enum_name.hpp"

namespace loopwarden::analysis {
namespace {

struct Settings {
  double kp = 0.0;
  double ti_s = 0.0;
  double td_s = 0.0;
};

std::optional<Settings> pi_settings(TuningRule rule, double k, double t, double l, double lambda) {
  if (rule == TuningRule::lambda) return Settings{t / (k * (lambda + l)), t};
  if (!(l > 0.0)) return std::nullopt;
  switch (rule) {
    case TuningRule::zn_thesis: return Settings{0.9 * t / l, l / 0.3};
    case TuningRule::zn: return Settings{0.9 * t / (k * l), l / 0.3};
    case TuningRule::cohen_coon:
      return Settings{t / (k * l) * (0.9 + l / (12.0 * t)),
                      l * (30.0 + 3.0 * l / t) / (9.0 + 20.0 * l / t)};
    case TuningRule::simc: return Settings{t / (k * 2.0 * l), std::min(t, 8.0 * l)};
    case TuningRule::amigo: {
      const double share = l * t / ((l + t) * (l + t));
      return Settings{0.15 / k + (0.35 - share) * t / (k * l),
                      0.35 * l + 13.0 * l * t * t / (t * t + 12.0 * l * t + 7.0 * l * l)};
    }
    case TuningRule::lambda: break;
  }
  return std::nullopt;
}

std::optional<Settings> pid_settings(TuningRule rule, double k, double t, double l, double lambda) {
  if (rule == TuningRule::lambda) {
    return Settings{(t + l / 2.0) / (k * (lambda + l / 2.0)), t + l / 2.0, t * l / (2.0 * t + l)};
  }
  if (!(l > 0.0)) return std::nullopt;
  switch (rule) {
    case TuningRule::zn: return Settings{1.2 * t / (k * l), 2.0 * l, l / 2.0};
    case TuningRule::cohen_coon:
      return Settings{t / (k * l) * (4.0 / 3.0 + l / (4.0 * t)),
                      l * (32.0 + 6.0 * l / t) / (13.0 + 8.0 * l / t),
                      4.0 * l / (11.0 + 2.0 * l / t)};
    case TuningRule::amigo:
      return Settings{(0.2 + 0.45 * t / l) / k, l * (0.4 * l + 0.8 * t) / (l + 0.1 * t),
                      0.5 * l * t / (0.3 * l + t)};
    case TuningRule::zn_thesis:
    case TuningRule::simc:
    case TuningRule::lambda: break;
  }
  return std::nullopt;
}

std::optional<Settings> integrating_settings(TuningRule rule, ControllerForm form, double k,
                                             double l, double lambda) {
  const bool pi = form == ControllerForm::pi;
  if (rule == TuningRule::lambda && pi && lambda + l > 0.0) {
    const double ti = 2.0 * lambda + l;
    return Settings{ti / (k * (lambda + l) * (lambda + l)), ti};
  }
  if (!(l > 0.0)) return std::nullopt;
  switch (rule) {
    case TuningRule::zn:
      return pi ? Settings{0.9 / (k * l), l / 0.3} : Settings{1.2 / (k * l), 2.0 * l, l / 2.0};
    case TuningRule::amigo:
      return pi ? Settings{0.35 / (k * l), 13.4 * l} : Settings{0.45 / (k * l), 8.0 * l, l / 2.0};
    case TuningRule::simc:
      if (pi) return Settings{1.0 / (k * 2.0 * l), 8.0 * l};
      break;
    case TuningRule::zn_thesis:
    case TuningRule::cohen_coon:
    case TuningRule::lambda: break;
  }
  return std::nullopt;
}

}  // namespace

const char* to_text(TuningRule rule) noexcept {
  return numeric::enum_name<TuningRule::amigo>(
      rule, {"zn-thesis", "zn", "cohen-coon", "lambda", "simc", "amigo"});
}

std::optional<control::PidGains> tune(TuningRule rule, const plant::ProcessParameters& process,
                                      const TuningOptions& options) {
  const double k = std::abs(process.gain);
  const bool integrating = process.integrating();
  const double second = process.second_time_constant_s;
  const double larger = std::max(process.time_constant_s, second);
  const double half = integrating ? second / 2.0 : std::min(process.time_constant_s, second) / 2.0;
  const double t = larger + half;
  const double l = process.dead_time_s + half;
  if (!(k > 0.0) || !(integrating || t > 0.0)) return std::nullopt;
  const double lambda = options.lambda_s.value_or(integrating ? 3.0 * l : std::max(t, l));
  const std::optional<Settings> s =
      integrating                          ? integrating_settings(rule, options.form, k, l, lambda)
      : options.form == ControllerForm::pi ? pi_settings(rule, k, t, l, lambda)
                                           : pid_settings(rule, k, t, l, lambda);
  if (!s) return std::nullopt;
  return control::PidGains{.kp = s->kp,
                           .ki = s->kp / s->ti_s,
                           .kd = s->kp * s->td_s,
                           .derivative_filter_s = s->td_s / 10.0};
}

}  // namespace loopwarden::analysis
