// SPDX-License-Identifier: Apache-2.0
#include "bench/hidden_cases/truth_loop.hpp"

#include <algorithm>
#include <cmath>

namespace loopwarden::hidden_cases {
namespace {

constexpr int kStepsPerSample = 100;
constexpr double kLoadMemory_s = 300.0;

double rounded(double value) { return std::round(value / kResolution) * kResolution; }

double sample_time_s(std::size_t k, std::size_t first) {
  return kPeriod_s * (static_cast<double>(k) - static_cast<double>(first));
}

double added_at(const TruthLoop& loop, double time_s) {
  double sum = 0.0;
  for (const auto& signal : loop.added) sum += signal(time_s);
  return sum;
}

// The controller output that holds PV at rest; the static path only rises.
double rest_output(TruthLoop& loop, double pv) {
  double low = 0.0;
  double high = 10.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (reset(loop.path, middle) < pv ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Brings the path to rest with PV at `pv` when nothing but the signals of time 0 is added.
double settle(TruthLoop& loop, double pv) {
  const double output = rounded(rest_output(loop, pv - added_at(loop, 0.0)));
  reset(loop.path, output);
  return output;
}

double hold(TruthLoop& loop, double co, double time_s) {
  double flow = 0.0;
  for (int i = 0; i < kStepsPerSample; ++i) flow = step(loop.path, co, time_s + kStep_s * i);
  return flow;
}

}  // namespace

double SampledPi::step(double set_point, double pv) {
  const double error = set_point - pv;
  integral_ = std::clamp(integral_ + tuning_.ki_per_s * kPeriod_s * error, -10.0, 10.0);
  return rounded(std::clamp(tuning_.kp * error + integral_, 0.0, 10.0));
}

double set_point_at(const SetPointProfile& profile, double time_s) {
  double value = profile.front().second;
  for (const auto& [from_s, level] : profile) {
    if (time_s >= from_s - 0.5 * kPeriod_s) value = level;
  }
  return value;
}

LoopRecord run(TruthLoop& loop, const SetPointProfile& profile, std::size_t samples,
               std::size_t before, Random& random) {
  LoopRecord record;
  record.first = before;
  const double rest = profile.front().second;
  const double start = settle(loop, rest);
  SampledPi controller(loop.tuning, start);
  const double forget = std::exp(-kPeriod_s / kLoadMemory_s);
  double process_pv = reset(loop.path, start);
  double load = 0.0;
  for (std::size_t k = 0; k < before + samples; ++k) {
    const double time_s = sample_time_s(k, before);
    const double clean = process_pv + added_at(loop, time_s);
    const double seen = std::min(clean + load, loop.transmitter_top);
    const double noise = loop.noise_rms * random.normal();
    const bool is_new = k % loop.reading_stands == before % loop.reading_stands;
    const double pv =
        is_new || k == 0 ? rounded(std::clamp(seen + noise, 0.0, 10.0)) : record.pv.back();
    const double sp = set_point_at(profile, time_s);
    if (loop.retuned && time_s >= loop.retuned->first) controller.retune(loop.retuned->second);
    const double co = controller.step(sp, pv);
    record.time_s.push_back(time_s);
    record.sp.push_back(sp);
    record.pv.push_back(pv);
    record.co.push_back(co);
    record.truth_pv.push_back(is_new || k == 0
                                  ? std::clamp(std::min(clean, loop.transmitter_top), 0.0, 10.0)
                                  : record.truth_pv.back());
    process_pv = hold(loop, co, time_s);
    const bool later = loop.load_later && time_s >= loop.load_later->first;
    const double per_root_s = later ? loop.load_later->second : loop.load_per_root_s;
    load = forget * load + per_root_s * std::sqrt(kPeriod_s) * random.normal();
  }
  return record;
}

std::vector<double> free_run(TruthLoop& loop, double rest_pv, const std::vector<double>& co,
                             std::size_t first) {
  std::vector<double> pv;
  const double start = settle(loop, rest_pv);
  double process_pv = reset(loop.path, start);
  for (std::size_t k = 0; k < co.size(); ++k) {
    const double time_s = sample_time_s(k, first);
    const double clean = process_pv + added_at(loop, time_s);
    pv.push_back(std::clamp(std::min(clean, loop.transmitter_top), 0.0, 10.0));
    process_pv = hold(loop, co[k], time_s);
  }
  return pv;
}

double floor_rmse(const LoopRecord& record) {
  const std::size_t samples = record.pv.size() - record.first;
  const std::size_t from = record.first + samples * 2 / 3;
  double sum = 0.0;
  for (std::size_t k = from; k < record.pv.size(); ++k) {
    sum += (record.pv[k] - record.truth_pv[k]) * (record.pv[k] - record.truth_pv[k]);
  }
  return std::sqrt(sum / static_cast<double>(record.pv.size() - from));
}

}  // namespace loopwarden::hidden_cases
