// SPDX-License-Identifier: Apache-2.0
#include "model/twin/twin_detectability.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "model/watch/controller_watch.hpp"
#include "model/watch/twin_watch.hpp"
#include "model/numeric/enum_name.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::twin {
namespace {

constexpr double kBefore = 20.0;  // answers
constexpr double kLeastMoves_s = 60.0;
constexpr std::size_t kFewest = TwinSeen::kRuns - 1;

// The twin's set-point moves over and over.
void repeat_moves(plant::LoopModel& model, double until_s) {
  const std::vector<std::pair<double, double>> own = model.scenario.set_point;
  if (own.empty()) return;
  const double round_s =
      std::max({kLeastMoves_s, model.scenario.duration_s, own.back().first + kLeastMoves_s});
  for (double at_s = round_s; at_s < until_s; at_s += round_s) {
    for (const auto& [time_s, set_point] : own) {
      model.scenario.set_point.emplace_back(at_s + time_s, set_point);
    }
  }
}

class ChangedRuns {
 public:
  ChangedRuns(const plant::LoopModel& twin, std::uint64_t seed) : twin_(twin), seed_(seed) {
    answer_s_ = std::max(plant::answer_s(twin), twin.sample_time_s);
  }

  double size_of(TwinSees change, double size) const {
    const bool time = change == TwinSees::dead_time || change == TwinSees::lag;
    return time ? size * answer_s_ : size;
  }

  // From the change to the alarm, s; infinity: none came.
  double alarm_after_s(TwinSees change, double size, std::size_t run) const {
    plant::LoopModel model = twin_;
    const bool controller = change == TwinSees::controller;
    const double from_s = controller ? 0.0 : kBefore * answer_s_;
    const double until_s = from_s + TwinSeen::kWithin_s;
    repeat_moves(model, until_s);
    model.scenario.faults.clear();
    model.scenario.seed = seed_ + run;
    add(change, size_of(change, size), from_s, model);
    const double resolution = model.twin && model.twin->controller
                                  ? model.twin->controller->resolution
                                  : model.controller.pid.output_span() / 4096.0;
    plant::SimulatedLoop loop(model, resolution);
    watch::TwinWatch watch(twin_);
    watch::ControllerWatch law(twin_);
    for (double t = 0.0; t < until_s; t += twin_.sample_time_s) {
      const plant::LoopSample s = loop.step();
      bool on = false;
      if (controller) {
        law.add(s.sp, s.pv, s.co);
        on = law.on();
      } else {
        watch.add(s.pv, s.co);
        on = watch.on();
      }
      if (on) return t >= from_s ? t - from_s : std::numeric_limits<double>::infinity();
    }
    return std::numeric_limits<double>::infinity();
  }

 private:
  static void add(TwinSees change, double size, double from_s, plant::LoopModel& model) {
    const auto fault = [&](const char* name, const char* key, double value) {
      model.scenario.faults.push_back(
          {{name, {{key, value}}}, effects::Block::process, {.from_s = from_s}});
    };
    switch (change) {
      case TwinSees::gain: return fault("gain_change", "factor", 1.0 + size);
      case TwinSees::dead_time: return fault("extra_dead_time", "seconds", size);
      case TwinSees::lag: return fault("extra_lag", "time_constant", size);
      case TwinSees::controller: break;
    }
    auto& gains = model.controller.pid.gains;
    gains.kp *= 1.0 + size;
    gains.ki *= 1.0 + size;
    gains.kd *= 1.0 + size;
  }

  const plant::LoopModel& twin_;
  std::uint64_t seed_;
  double answer_s_;
};

}  // namespace

const char* to_text(TwinSees change) noexcept {
  return numeric::enum_name<TwinSees::controller>(change,
                                                  {"gain", "dead_time", "lag", "controller"});
}

std::vector<TwinSeen> look_by_twin(const plant::LoopModel& twin, std::uint64_t seed,
                                   const numeric::ParallelFor& parallel) {
  std::vector<TwinSeen> seen{
      {TwinSees::gain, {}, {}}, {TwinSees::dead_time, {}, {}}, {TwinSees::lag, {}, {}}};
  if (watch::ControllerWatch(twin).watched()) seen.push_back({TwinSees::controller, {}, {}});
  const ChangedRuns runs(twin, seed);
  parallel(seen.size(), [&](std::size_t i) {
    TwinSeen& one = seen[i];
    std::size_t low = 0;
    std::size_t high = TwinSeen::kSizes.size();
    while (low < high) {
      const std::size_t middle = (low + high) / 2;
      std::array<double, TwinSeen::kRuns> after_s{};
      for (std::size_t k = 0; k < after_s.size(); ++k) {
        after_s[k] = runs.alarm_after_s(one.change, TwinSeen::kSizes[middle], k);
      }
      std::sort(after_s.begin(), after_s.end());
      if (!std::isfinite(after_s[kFewest - 1])) {
        low = middle + 1;
        continue;
      }
      high = middle;
      one.size = runs.size_of(one.change, TwinSeen::kSizes[middle]);
      one.to_alarm_s = after_s[TwinSeen::kRuns / 2];
    }
  });
  return seen;
}

}  // namespace loopwarden::twin
