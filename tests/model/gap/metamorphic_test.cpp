// SPDX-License-Identifier: Apache-2.0
// Changes of notation, which change neither loop nor record, must not change the answer.
// workflow_test.cpp has other units.
#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "tests/model/gap/few_names.hpp"

namespace metamorphic_test {

using namespace loopwarden;

namespace {

constexpr double kRecord_s = 130.0;

gap::Result find(const numeric::LoopRecord& record, const plant::LoopModel& model) {
  return test::find_among({"stiction", "backlash", "gain_change", "extra_lag", "output_bias",
                           "step_disturbance", "drift", "extra_dead_time"},
                          record, model);
}

std::string name_of(const gap::Result& result) {
  return result.effects.size() == 1 ? result.effects[0].spec.name : "";
}

double parameter(const gap::Result& result, const char* name) {
  return result.effects.at(0).spec.parameters.at(name);
}

plant::LoopModel with(const effects::EffectSpec& effect, effects::Block block) {
  plant::LoopModel truth = test::believed_model();
  (block == effects::Block::valve     ? truth.valve_effects
   : block == effects::Block::process ? truth.process_effects
                                      : truth.disturbances)
      .push_back(effect);
  return truth;
}

numeric::LoopRecord part(const numeric::LoopRecord& whole, std::size_t from, std::size_t to) {
  const auto cut = [&](const std::vector<double>& v) {
    return std::vector<double>(v.begin() + static_cast<std::ptrdiff_t>(from),
                               v.begin() + static_cast<std::ptrdiff_t>(to));
  };
  numeric::LoopRecord out = whole;
  out.pv = cut(whole.pv);
  out.sp = cut(whole.sp);
  out.co = cut(whole.co);
  return out;
}

}  // namespace

TEST_CASE("a stretch of time and of the model's times gives the same name with stretched times",
          "[gap][metamorphic]") {
  const plant::LoopModel model = test::believed_model();
  plant::LoopModel slow = model;
  slow.sample_time_s *= 2.0;
  slow.process.time_constant_s *= 2.0;
  slow.process.dead_time_s *= 2.0;
  slow.controller.pid.gains.ki /= 2.0;
  const numeric::LoopRecord record =
      test::record_of(with({"extra_lag", {{"time_constant", 1.2}}}, effects::Block::process), 90.0);
  numeric::LoopRecord stretched = record;
  stretched.period_s *= 2.0;
  const gap::Result one = find(record, model);
  const gap::Result two = find(stretched, slow);
  CHECK(name_of(one) == "extra_lag");
  CHECK(name_of(two) == "extra_lag");
  CHECK(two.outcome == one.outcome);
  CHECK(parameter(two, "time_constant") ==
        Approx(2.0 * parameter(one, "time_constant")).epsilon(0.04));
}

TEST_CASE("a record that begins later gives the same name, its moments shifted",
          "[gap][metamorphic]") {
  const plant::LoopModel model = test::believed_model();
  const numeric::LoopRecord record = test::record_of(
      with({"step_disturbance", {{"size", 0.6}, {"time", 50.0}}}, effects::Block::disturbance),
      kRecord_s);
  const gap::Result whole = find(record, model);
  const gap::Result later = find(part(record, 150, record.size()), model);
  CHECK(name_of(whole) == "step_disturbance");
  CHECK(name_of(later) == "step_disturbance");
  CHECK(later.outcome == whole.outcome);
  CHECK(parameter(later, "time") == Approx(parameter(whole, "time") - 15.0).margin(0.3));
  CHECK(parameter(later, "size") == Approx(parameter(whole, "size")).epsilon(0.05));
}

TEST_CASE("half of a record never gives a permanent effect another name", "[gap][metamorphic]") {
  const plant::LoopModel model = test::believed_model();
  const effects::EffectSpec effect =
      GENERATE(effects::EffectSpec{"backlash", {{"deadband", 0.8}}},
               effects::EffectSpec{"stiction", {{"s", 0.9}, {"j", 0.4}}});
  const numeric::LoopRecord record =
      test::record_of(with(effect, effects::Block::valve), kRecord_s);
  const std::size_t middle = record.size() / 2;
  for (const numeric::LoopRecord& half :
       {part(record, 0, middle), part(record, middle, record.size())}) {
    const gap::Result result = find(half, model);
    INFO(effect.name << ": " << result.sentence);
    const bool same = name_of(result) == effect.name;
    const bool says_so = result.outcome == gap::Outcome::unexplained;
    CHECK((same || says_so));
  }
}

}  // namespace metamorphic_test
