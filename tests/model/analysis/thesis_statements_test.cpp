// SPDX-License-Identifier: Apache-2.0
// Statements of the thesis's chapters 3 and 7 on measured quantities; docs/project/thesis.md lists
// them.
#include <catch2/catch.hpp>
#include <cmath>
#include <vector>

#include "model/plant/plant.hpp"
#include "model/plant/simulated_loop.hpp"

namespace thesis_statements_test {

using namespace loopwarden;

namespace {

plant::LoopModel plant1(std::vector<effects::EffectSpec> effects) {
  plant::LoopModel m;
  m.controller.pid.gains = {.kp = 0.3494, .ki = 0.0400074};
  m.controller.pid.output_high = 10.0;
  m.controller.pid.anti_windup = control::AntiWindup::back_calculation;
  m.controller.output.high = 10.0;
  m.controller.set_point.high = 10.0;
  m.process = {.gain = 1.2264, .time_constant_s = 1.69376, .dead_time_s = 2.6256};
  m.transmitter.high = 10.0;
  m.valve_effects = std::move(effects);
  return m;
}

effects::EffectSpec effect(const char* name, std::map<std::string, double> parameters) {
  return {.name = name, .parameters = std::move(parameters)};
}

struct Answer {
  double begins_s = 0.0;   // PV has moved by 2 % of the step
  double arrives_s = 0.0;  // 95 %
  double offset = 0.0;     // SP - PV at the end, PV units
};

// The set point rises after the valve has arrived at 5 L/min from above.
Answer answer(plant::LoopModel m, double step) {
  constexpr double kFrom = 300.0;
  m.scenario.set_point = {{0.0, 8.0}, {20.0, 5.0}, {kFrom, 5.0 + step}};
  plant::SimulatedLoop loop(m);
  Answer a{.begins_s = 1e9, .arrives_s = 1e9};
  double start = 0.0;
  for (plant::LoopSample s = loop.step(); s.time_s < 900.0; s = loop.step()) {
    a.offset = s.sp - s.true_pv;
    if (s.time_s <= kFrom) {
      start = s.true_pv;
      continue;
    }
    const double share = (s.true_pv - start) / step;
    if (share > 0.02) a.begins_s = std::min(a.begins_s, s.time_s - kFrom);
    if (share > 0.95) a.arrives_s = std::min(a.arrives_s, s.time_s - kFrom);
  }
  return a;
}

}  // namespace

TEST_CASE("backlash lengthens the dead time, less so for a large error", "[thesis]") {
  const auto with = [](double deadband, double step) {
    return answer(plant1({effect("backlash", {{"deadband", deadband}})}), step);
  };
  const Answer none = answer(plant1({}), 1.0);
  const Answer some = with(0.5, 1.0);
  const Answer more = with(1.5, 1.0);
  CHECK(some.begins_s > none.begins_s + 1.0);
  CHECK(more.begins_s > some.begins_s + 3.0);
  CHECK(more.arrives_s > some.arrives_s);
  CHECK(some.arrives_s > none.arrives_s);
  CHECK(with(1.5, 3.0).begins_s < 0.7 * more.begins_s);
  CHECK(std::abs(more.offset) < 0.05);
  // P only: the offset that the backlash holds back remains.
  plant::LoopModel p_only = plant1({effect("backlash", {{"deadband", 1.5}})});
  plant::LoopModel p_healthy = plant1({});
  p_only.controller.pid.gains.ki = p_healthy.controller.pid.gains.ki = 0.0;
  CHECK(std::abs(answer(p_only, 1.0).offset) > std::abs(answer(p_healthy, 1.0).offset) + 0.1);
}

TEST_CASE("hysteresis and low air delay PV, and too little air keeps it from SP", "[thesis]") {
  const Answer none = answer(plant1({}), 1.0);
  CHECK(answer(plant1({effect("hysteresis", {{"width", 1.0}})}), 1.0).arrives_s >
        none.arrives_s + 3.0);
  const auto air = [](double rate, double limit) {
    return answer(plant1({effect("low_air_supply", {{"rate", rate}, {"travel_limit", limit}})}),
                  1.0);
  };
  const Answer low = air(0.05, 9.0);
  const Answer lower = air(0.02, 9.0);
  CHECK(low.begins_s >= none.begins_s);
  CHECK(lower.arrives_s > low.arrives_s);
  CHECK(lower.arrives_s > none.arrives_s + 3.0);
  CHECK(air(0.05, 4.5).offset == Approx(6.0 - 4.5 * 1.2264).margin(0.02));
}

TEST_CASE("hysteresis gives a smaller step on the way back, and a saturating valve the thesis's",
          "[thesis]") {
  const auto steps = [](std::vector<effects::EffectSpec> valve) {
    valve.insert(valve.begin(), effect("hysteresis", {{"offset", 0.7}}));
    plant::Plant p(plant1(std::move(valve)), 1);
    p.reset(1.0);
    const auto rest = [&](double co) {
      for (int k = 0; k < 600; ++k) p.step(co);
      return p.process_variable();
    };
    const double low = rest(2.0);
    const double high = rest(4.0);
    return std::pair(high - low, high - rest(2.0));
  };
  const auto [up, down] = steps({});
  CHECK(up == Approx(2.0 * 1.2264));
  CHECK(down == Approx(1.3 * 1.2264));
  effects::EffectSpec table = effect("valve_characteristic", {});
  table.options = {{"curve", "table"}};
  table.table = {
      {0.0, 0.0}, {2.0, 1.6}, {2.7, 1.6 + 0.55 / 1.2264}, {4.0, 1.6 + 0.85 / 1.2264}, {10.0, 10.0}};
  const auto [curved_up, curved_down] = steps({table});
  CHECK(curved_up == Approx(0.85).epsilon(1e-3));
  CHECK(curved_down == Approx(0.30).epsilon(1e-3));
}

}  // namespace thesis_statements_test
