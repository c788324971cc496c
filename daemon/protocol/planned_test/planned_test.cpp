// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/planned_test/planned_test.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <thread>
#include <utility>

#include "daemon/protocol/ask.hpp"
#include "model/plant/simulated_loop.hpp"
#include "daemon/protocol/planned_test/in_force.hpp"
#include "daemon/protocol/planned_test/test_session.hpp"

namespace loopwarden::protocol {
namespace {

using std::chrono::steady_clock;

constexpr double kSameSp = 0.001;      // of the PV span
constexpr double kRestAnswers = 20.0;  // answer times before the move of a simulated test
constexpr double kRampStep = 0.02;     // of the size: steps of a ramp

// Adds the rows of one answer. `first_period`: of the first move; 0: not known yet.
void add_rows(TestRecord& record, const Trend& fresh, std::uint64_t& next_period,
              std::vector<std::uint64_t>& periods) {
  for (std::size_t i = 0; i < fresh.period.size(); ++i) {
    periods.push_back(fresh.period[i]);
    record.sp.push_back(fresh.sp[i]);
    record.pv.push_back(fresh.pv[i]);
    record.co.push_back(fresh.co[i]);
    record.stem.push_back(fresh.stem[i]);
    next_period = fresh.period[i] + 1;
  }
}

TestTerms terms_of(const TestPlanFile& plan, double from) {
  constexpr double kSpare_s = 60.0;  // of the loop's time
  const double farthest = std::abs(plan.move.size);
  return {.pv = plan.pv_limits,
          .co = plan.co_limits,
          .moved = {from - farthest, from + farthest},
          .manual = estimator::in_manual(plan.move.kind),
          .longest_s = estimator::duration_s(plan.move) + kSpare_s,
          .plan = fmt::format("{}, from {:.5g}, size {:.5g}", estimator::to_text(plan.move.kind),
                              from, plan.move.size)};
}

// Returns where the plan is at this time, if the step from `sent` to there is not too small.
std::optional<double> next_move(const TestPlanFile& plan, double from, double sent, double time_s) {
  const double to = estimator::moved(plan.move, from, time_s);
  const bool far = std::abs(to - sent) >= kRampStep * std::abs(plan.move.size);
  if (to == sent || (!far && to != from)) return std::nullopt;
  return to;
}

}  // namespace

TestRecord simulate_test(const plant::LoopModel& given, const TestPlanFile& plan) {
  plant::LoopModel model = given;
  const double rest_s = kRestAnswers * std::max(plant::answer_s(model), model.sample_time_s);
  const auto rest = static_cast<std::size_t>(std::ceil(rest_s / model.sample_time_s));
  const auto count =
      static_cast<std::size_t>(std::ceil(estimator::duration_s(plan.move) / model.sample_time_s));
  const bool manual = estimator::in_manual(plan.move.kind);
  const auto moved = [&](std::size_t k) {
    return estimator::moved(plan.move, plan.from, static_cast<double>(k) * model.sample_time_s);
  };
  auto& profile = model.scenario.set_point;
  if (!manual || profile.empty()) {
    const double sp = manual ? (plan.pv_limits[0] + plan.pv_limits[1]) / 2.0 : plan.from;
    profile = {{0.0, sp}};
    for (std::size_t k = 0; k < count && !manual; ++k) {
      if (moved(k) == profile.back().second) continue;
      profile.emplace_back(static_cast<double>(rest + k) * model.sample_time_s, moved(k));
    }
  }
  TestRecord record;
  record.period_s = model.sample_time_s;
  const auto add = [&](double sp, double pv, double co, double stem) {
    const double k = static_cast<double>(record.pv.size()) - static_cast<double>(rest);
    record.time_s.push_back(k * model.sample_time_s);
    record.sp.push_back(sp);
    record.pv.push_back(pv);
    record.co.push_back(co);
    record.stem.push_back(stem);
  };
  plant::SimulatedLoop loop(model);
  for (std::size_t k = 0; k < rest + (manual ? 0 : count); ++k) {
    const plant::LoopSample s = loop.step();
    add(s.sp, s.pv, s.co, s.stem);
  }
  if (!manual) return record;
  plant::Plant plant = loop.plant();
  const double start = record.co.back();
  for (std::size_t k = 0; k < count; ++k) {
    const double co = start + moved(k) - plan.from;
    add(record.sp.back(), plant.process_variable(), co, plant.stem());
    plant.step(co);
  }
  return record;
}

std::string why_no_test(Daemon& daemon, const LoopStatus& loop, const TestPlanFile& plan) {
  const std::string& tag = loop.name;
  if (!plan.loop.empty() && plan.loop != tag) {
    return fmt::format("the plan is for {}, not for {}", plan.loop, tag);
  }
  if (std::string why = not_in_force(daemon, tag); !why.empty()) return why;
  const std::optional<LoopFile> file = file_of_loop(daemon, tag);
  if (!file) return tag + ": the daemon does not report the loop's file";
  const bool changed = plan.configuration && *plan.configuration != file->hash;
  if (changed || file->time_s > plan.planned_at) {
    return fmt::format("{} has changed since the plan was made ({}). Make a new plan.", file->path,
                       utc_time_text(plan.planned_at));
  }
  if (!loop.cycle) return "the loop has not run yet";
  const Cycle& now = *loop.cycle;
  const bool manual = estimator::in_manual(plan.move.kind);
  const double span = loop.pv_range[1] - loop.pv_range[0];
  if (!manual && !(std::abs(now.set_point_wanted - plan.from) <= kSameSp * span)) {
    return fmt::format(
        "SP is {:.5g}, and the plan begins at {:.5g} {}. Set SP to it, or plan again.",
        now.set_point_wanted, plan.from, loop.pv_unit);
  }
  if (manual && !(std::abs(now.co - plan.from) <= std::abs(plan.move.size))) {
    return fmt::format("the output is {:.4g}, and the plan begins at {:.4g} {}. Plan again.",
                       now.co, plan.from, loop.co_unit);
  }
  return {};
}

CarriedOut carry_out(Daemon& daemon, const TestPlanFile& plan, const Person& person,
                     const std::function<std::string(const TestProgress&)>& watch) {
  const LoopStatus before = loop_of_daemon(daemon, plan.loop);
  const bool manual = estimator::in_manual(plan.move.kind);
  const double from = manual ? before.cycle.value().co : plan.from;
  const double accelerate = ask(daemon, StatusRequest{}).daemon.accelerate;
  CarriedOut out;
  out.record.period_s = before.sample_time_s;
  std::vector<std::uint64_t> periods;
  std::uint64_t next_period = 0;
  const auto read = [&] {
    add_rows(out.record, ask(daemon, TrendRequest{.loop = plan.loop, .from = next_period}),
             next_period, periods);
  };
  read();
  std::uint64_t begun = next_period;
  const auto pause = std::chrono::duration<double>(
      std::clamp(0.5 * before.sample_time_s / accelerate, 0.005, 0.1));
  try {
    TestSession session(daemon, plan.loop, terms_of(plan, from), person);
    double sent = from;
    read();
    begun = next_period;
    const double duration_s = estimator::duration_s(plan.move);
    auto newest = steady_clock::now();
    for (double time_s = 0.0; time_s < duration_s;) {
      const std::optional<double> to = next_move(plan, from, sent, time_s);
      if (!to) {
        session.alive();
      } else if (session.move(*to)) {
        sent = *to;
      }
      std::this_thread::sleep_for(pause);
      const std::uint64_t last = next_period;
      read();
      if (next_period != last) newest = steady_clock::now();
      time_s = static_cast<double>(next_period - begun) * before.sample_time_s;
      const std::string why =
          watch({time_s, out.record.sp.back(), out.record.pv.back(), out.record.co.back()});
      if (!why.empty()) {
        out.ended_early = why;
        break;
      }
      if (steady_clock::now() - newest > std::chrono::seconds(10)) {
        out.ended_early = "no samples arrive";
        break;
      }
    }
    session.end(out.ended_early);
  } catch (const DaemonError& e) {
    if (!e.refused()) throw;
    out.ended_early = e.what();
  }
  for (const std::uint64_t period : periods) {
    out.record.time_s.push_back((static_cast<double>(period) - static_cast<double>(begun)) *
                                before.sample_time_s);
  }
  return out;
}

}  // namespace loopwarden::protocol
