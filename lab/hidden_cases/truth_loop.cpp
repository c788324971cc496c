// SPDX-License-Identifier: Apache-2.0
#include "lab/hidden_cases/truth_loop.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

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

// Returns the controller output that holds the reading at rest; the static path only rises.
double rest_output(TruthLoop& loop, double pv) {
  double low = 0.0;
  double high = 10.0;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    const double there = reset(loop.path, middle) + added_at(loop, 0.0);
    ((loop.meter ? loop.meter(there) : there) < pv ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

// Brings the path to rest with PV at `pv` and the added signals of time 0 only.
double settle(TruthLoop& loop, double pv) {
  const double output = rounded(rest_output(loop, pv));
  reset(loop.path, output);
  return output;
}

// PV after the lag of the impulse line, as measured by the transmitter.
class Sensed {
 public:
  explicit Sensed(const TruthLoop& loop) : loop_(loop) {}

  double step(double pv, double time_s) {
    if (!loop_.line_lag_s) return pv;
    const double from = std::exchange(last_, pv);
    if (std::isnan(from)) return line_ = pv;
    for (int i = 1; i <= kStepsPerSample; ++i) {
      const double now = from + (pv - from) * i / kStepsPerSample;
      line_ += (now - line_) * kStep_s / (loop_.line_lag_s(std::max(time_s, 0.0)) + kStep_s);
    }
    return line_;
  }

 private:
  const TruthLoop& loop_;
  double last_ = std::nan("");
  double line_ = 0.0;
};

// Returns the reading without noise.
double reading(const TruthLoop& loop, double sensed) {
  return std::min(loop.meter ? loop.meter(sensed) : sensed, loop.transmitter_top);
}

double in_range(double pv) { return std::clamp(pv, 0.0, 10.0); }

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
               std::size_t before, Random& random, const Moves& moves) {
  LoopRecord record;
  record.first = before;
  const double rest = profile.front().second;
  const double start = settle(loop, rest);
  SampledPi controller(loop.tuning, start);
  const double forget = std::exp(-kPeriod_s / kLoadMemory_s);
  double process_pv = reset(loop.path, start);
  double load = 0.0;
  Sensed quiet(loop);
  Sensed loaded(loop);
  const std::size_t begin = before + samples + moves.from;  // of the moves
  for (std::size_t k = 0; k < begin + moves.moved.size(); ++k) {
    const double by = k < begin ? 0.0 : moves.moved[k - begin];
    const double time_s = sample_time_s(k, before);
    const double clean = process_pv + added_at(loop, time_s);
    const double without_load = in_range(reading(loop, quiet.step(clean, time_s)));
    const double seen = reading(loop, loaded.step(clean + load, time_s));
    const double noise = loop.noise_rms * random.normal();
    const bool is_new = k % loop.reading_stands == before % loop.reading_stands;
    const double pv = is_new || k == 0 ? rounded(in_range(seen + noise)) : record.pv.back();
    const double sp = set_point_at(profile, time_s) + (moves.manual ? 0.0 : by);
    if (loop.retuned && time_s >= loop.retuned->first) controller.retune(loop.retuned->second);
    const bool manual = moves.manual && k >= begin;
    const double co =
        manual ? rounded(in_range(record.co[begin - 1] + by)) : controller.step(sp, pv);
    record.time_s.push_back(time_s);
    record.sp.push_back(sp);
    record.pv.push_back(pv);
    record.co.push_back(co);
    record.truth_pv.push_back(is_new || k == 0 ? without_load : record.truth_pv.back());
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
  Sensed sensed(loop);
  for (std::size_t k = 0; k < co.size(); ++k) {
    const double time_s = sample_time_s(k, first);
    const double clean = process_pv + added_at(loop, time_s);
    pv.push_back(in_range(reading(loop, sensed.step(clean, time_s))));
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
