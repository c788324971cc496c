// SPDX-License-Identifier: Apache-2.0
#include "lab/identify_study/identification_cases.hpp"

#include <algorithm>
#include <cmath>

#include "model/numeric/draw.hpp"
#include "model/numeric/random.hpp"
#include "model/effects/backlash/backlash.hpp"
#include "model/effects/stiction/stiction_choudhury.hpp"
#include "model/numeric/enum_name.hpp"

namespace loopwarden::lab {
namespace {

constexpr double kCaseSpan = 100.0;
constexpr double kCaseResolution = kCaseSpan / 4096.0;
constexpr double kCaseMiddle = 50.0;

double to_12_bits(double value) {
  return kCaseResolution * std::nearbyint(value / kCaseResolution);
}

bool moved_by_hand(CaseKind kind) {
  return kind == CaseKind::open_steps || kind == CaseKind::open_steps_load;
}

bool under_load(CaseKind kind) {
  return kind != CaseKind::open_steps && kind != CaseKind::set_point && kind != CaseKind::still;
}

plant::ProcessParameters process_of_case(CaseKind kind, double period_s, numeric::Random& r) {
  plant::ProcessParameters p;
  p.time_constant_s = numeric::log_uniform(r, 4.0, 60.0) * period_s;
  p.dead_time_s = p.time_constant_s * numeric::log_uniform(r, 0.1, 1.5);
  p.gain = numeric::log_uniform(r, 0.3, 2.5) * (numeric::chance(r, 0.2) ? -1.0 : 1.0);
  if (numeric::chance(r, 0.25)) p.second_time_constant_s = p.time_constant_s * r.uniform(0.1, 0.6);
  if (kind == CaseKind::integrating) {
    p.kind = plant::ProcessKind::integrating;
    p.gain /= p.time_constant_s;
    p.time_constant_s = plant::ProcessParameters{}.time_constant_s;
  }
  return p;
}

}  // namespace

const char* to_text(CaseKind kind) noexcept {
  return numeric::enum_name<CaseKind::stiction>(
      kind,
      {"open, CO steps", "open, CO steps, load", "closed, SP moves", "closed, SP moves, load",
       "closed, SP moves little, load", "closed, SP moves, not recorded, load", "closed, load only",
       "closed, load only, SP not recorded", "closed, noise only", "closed, integrating, load",
       "closed, SP moves, load, backlash 1 %", "closed, SP moves, load, stiction 1 %"});
}

IdentificationCase draw_case(CaseKind kind, std::uint64_t seed) {
  numeric::Random r(seed * 1000003ULL + static_cast<std::uint64_t>(kind));
  IdentificationCase out;
  out.period_s = numeric::log_uniform(r, 0.1, 20.0);
  const double h = out.period_s;
  out.truth = process_of_case(kind, h, r);
  const plant::ProcessParameters& p = out.truth;
  const bool integrating = p.integrating();
  // SIMC, with the half rule, times a factor.
  const double lag = (integrating ? 0.0 : p.time_constant_s) + p.second_time_constant_s / 2.0;
  const double dead = std::max(p.dead_time_s + p.second_time_constant_s / 2.0, 2.0 * h);
  const double factor = r.uniform(0.4, 1.1);
  const double kp = factor * (integrating ? 1.0 : lag) / (p.gain * 2.0 * dead);
  const double ti = integrating ? 8.0 * dead / factor : std::min(lag, 8.0 * dead);
  const double slow = integrating ? 6.0 * dead : lag + dead;

  const double noise = numeric::log_uniform(r, 0.05, 0.5);                            // PV units
  const double load_sd = under_load(kind) ? numeric::log_uniform(r, 0.3, 2.0) : 0.0;  // in PV
  const double load_time = slow * numeric::log_uniform(r, 0.5, 10.0);
  const bool load_at_input = numeric::chance(r, 0.5);
  const double step =
      kind == CaseKind::set_point_small ? numeric::log_uniform(r, 0.1, 0.8) : r.uniform(2.0, 6.0);
  const double held_s = slow * r.uniform(4.0, 10.0);
  const auto moves = static_cast<std::size_t>(r.uniform(4.0, 12.0));
  const auto settle = static_cast<std::size_t>(6.0 * slow / h) + 20;
  const auto samples =
      std::max<std::size_t>(500, static_cast<std::size_t>(static_cast<double>(moves) * held_s / h));

  plant::Process process(p, h);
  plant::Process load_process({.gain = 1.0,
                               .time_constant_s = integrating ? slow : p.time_constant_s,
                               .dead_time_s = p.dead_time_s,
                               .second_time_constant_s = p.second_time_constant_s},
                              h);
  // An integrating process would integrate a load on CO's side without limit, so the load acts on
  // PV.
  effects::Backlash play(kind == CaseKind::backlash ? 1.0 : 0.0);
  effects::StictionChoudhury sticking({.s = 1.0, .j = 0.4});
  double valve = play.reset(kCaseMiddle);
  sticking.reset(kCaseMiddle);
  const double rest = integrating ? kCaseMiddle : 0.0;
  double q = process.reset(kCaseMiddle, rest);
  const double offset = kCaseMiddle - q;  // puts PV in the middle of its range
  load_process.reset(0.0);
  const double keep = std::exp(-h / load_time);
  double load = load_sd * r.normal();
  double load_in_pv = 0.0;
  double integral = kCaseMiddle;
  double sp = kCaseMiddle;
  double by_hand = kCaseMiddle;
  double next_s = 0.0;
  const std::size_t all = settle + samples;
  for (std::size_t k = 0; k < all; ++k) {
    const double now_s = (static_cast<double>(k) - static_cast<double>(settle)) * h;
    if (now_s >= next_s && now_s > 0.0) {
      next_s = now_s + held_s * r.uniform(0.6, 1.4);
      const double to =
          kCaseMiddle + step * r.uniform(-1.0, 1.0) + (sp > kCaseMiddle ? -0.5 : 0.5) * step;
      if (moved_by_hand(kind)) {
        by_hand = to_12_bits(kCaseMiddle + (to - kCaseMiddle) / std::abs(p.gain));
      } else if (kind != CaseKind::load_only && kind != CaseKind::load_only_hidden &&
                 kind != CaseKind::still) {
        sp = to_12_bits(to);
      }
    }
    const double pv = to_12_bits(q + offset + load_in_pv + noise * r.normal());
    double co = by_hand;
    if (!moved_by_hand(kind)) {
      const double e = sp - pv;
      integral = std::clamp(integral + kp / ti * h * e, 0.0, kCaseSpan);
      co = to_12_bits(std::clamp(kp * e + integral, 0.0, kCaseSpan));
    }
    if (k >= settle) {
      out.co.push_back(co);
      out.pv.push_back(pv);
      if (kind != CaseKind::set_point_hidden && kind != CaseKind::load_only_hidden)
        out.sp.push_back(moved_by_hand(kind) ? kCaseMiddle : sp);
    }
    valve = kind == CaseKind::stiction ? sticking.step(co) : play.step(co);
    q = process.step(valve);
    load = keep * load + load_sd * std::sqrt(1.0 - keep * keep) * r.normal();
    load_in_pv = load_at_input ? load_process.step(load) : load;
  }
  return out;
}

}  // namespace loopwarden::lab
