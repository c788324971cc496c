// SPDX-License-Identifier: Apache-2.0
// loopwarden-study receipt: records of simulated loops before and after work at the valve, with
// another load and other set points. In half of the cases the work removes the effect. With --gains
// the work is a change of the gains, in half of the cases none.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "base/parallel.hpp"
#include "lab/program/studies.hpp"
#include "model/analysis/gain_comparison.hpp"
#include "model/diagnosis/repair.hpp"
#include "model/numeric/random.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::lab {
namespace {

using diagnosis::RepairResult;

struct ReceiptOptions {
  std::size_t cases = 200;
  std::uint64_t seed = 910000;
  double hours = 4.0;
  bool list = false;
  bool gains = false;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
};

struct Record {
  std::vector<double> pv, sp, co;
};

Record simulated(const plant::LoopModel& model, double hours) {
  plant::SimulatedLoop loop(model, 0.01);
  Record record;
  const auto samples = static_cast<std::size_t>(hours * 3600.0 / model.sample_time_s);
  for (std::size_t k = 0; k < samples; ++k) {
    const plant::LoopSample sample = loop.step();
    record.pv.push_back(sample.pv);
    record.sp.push_back(sample.sp);
    record.co.push_back(sample.co);
  }
  return record;
}

// Judges the record in up to four windows.
std::vector<diagnosis::Diagnosis> judged(const Record& record, double period_s) {
  constexpr std::size_t kLeast = 1500;
  const std::size_t count = std::clamp<std::size_t>(record.pv.size() / kLeast, 1, 4);
  std::vector<diagnosis::Diagnosis> windows;
  for (std::size_t w = 0; w < count; ++w) {
    const std::size_t from = record.pv.size() * w / count;
    const std::size_t to = record.pv.size() * (w + 1) / count;
    windows.push_back(diagnosis::diagnose(
        numeric::LoopView{.period_s = period_s, .pv = record.pv, .sp = record.sp, .co = record.co}
            .part(from, to)));
  }
  std::vector<diagnosis::Diagnosis*> together;
  for (diagnosis::Diagnosis& d : windows) together.push_back(&d);
  diagnosis::share_reversals(together);
  return windows;
}

struct Case {
  bool removed = false;
  std::string truth;
  RepairResult result = RepairResult::cant_tell;
  std::string why{};
  double size = 0.0, found = 0.0, excluded = 0.0;
};

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : random_(seed * 1000003) {}
  double between(double low, double high) { return low + (high - low) * random_.uniform(); }
  double uniform() { return random_.uniform(); }

 private:
  numeric::Random random_;
};

plant::LoopModel drawn_loop(Draw& random) {
  constexpr std::array<double, 4> kPeriods_s{1.0, 2.0, 5.0, 10.0};
  const auto between = [&](double low, double high) { return random.between(low, high); };
  plant::LoopModel model;
  model.sample_time_s = kPeriods_s[static_cast<std::size_t>(4.0 * random.uniform()) % 4];
  const double period_s = model.sample_time_s;
  model.process = {.gain = between(0.6, 1.6),
                   .time_constant_s = period_s * between(2.0, 10.0),
                   .dead_time_s = period_s * between(0.5, 4.0)};
  model.transmitter = {.low = 0.0, .high = 100.0, .resolution = 0.0, .noise = between(0.03, 0.2)};
  const double closed_s = model.process.dead_time_s * between(1.0, 3.0);
  model.controller.pid.gains.kp =
      model.process.time_constant_s / (model.process.gain * (closed_s + model.process.dead_time_s));
  model.controller.pid.gains.ki =
      model.controller.pid.gains.kp /
      std::min(model.process.time_constant_s, 4.0 * (closed_s + model.process.dead_time_s));
  model.controller.pid.output_low = 0.0;
  model.controller.pid.output_high = 100.0;
  return model;
}

// Gives a record a load, a level and set points of its own.
void draw_disturbance(Draw& random, plant::LoopModel& part, double hours) {
  const double period_s = part.sample_time_s;
  const auto between = [&](double low, double high) { return random.between(low, high); };
  part.disturbances = {
      {"random_load",
       {{"intensity", between(0.01, 0.05)}, {"time_constant", between(60.0, 600.0) * period_s}}}};
  if (random.uniform() < 0.3) {
    part.disturbances.push_back(
        {"oscillating_disturbance",
         {{"amplitude", between(0.3, 1.5)}, {"period", between(40.0, 200.0) * period_s}}});
  }
  const double middle = part.process.gain * between(30.0, 70.0);
  for (double at_s = 0.0; at_s < hours * 3600.0; at_s += between(0.3, 2.0) * 3600.0) {
    part.scenario.set_point.emplace_back(at_s, std::clamp(middle + between(-5.0, 5.0), 5.0, 95.0));
  }
}

double rms_of(const Record& record) {
  double squares = 0.0;
  for (std::size_t k = 0; k < record.pv.size(); ++k)
    squares += (record.sp[k] - record.pv[k]) * (record.sp[k] - record.pv[k]);
  return std::sqrt(squares / static_cast<double>(record.pv.size()));
}

struct GainsCase {
  double ratio = 1.0;  // of the RMS after and before on the same disturbance, the truth
  analysis::GainChange found{};
};

// Half of the cases keep the gains. The model is up to 15 % off.
GainsCase run_gains_case(std::uint64_t seed, double hours) {
  Draw random(seed);
  plant::LoopModel model = drawn_loop(random);
  std::array<control::PidGains, 2> gains;
  gains.fill(model.controller.pid.gains);
  if (random.uniform() < 0.5) {
    const std::size_t slower = random.uniform() < 0.5 ? 0 : 1;
    const double factor = random.between(0.2, 0.7);
    gains[slower].kp *= factor;
    gains[slower].ki *= factor;
  }
  plant::LoopModel known = model;
  for (double* one :
       {&known.process.gain, &known.process.time_constant_s, &known.process.dead_time_s})
    *one *= random.between(0.85, 1.15);
  GainsCase result;
  std::array<analysis::GainRecord, 2> sides;
  for (std::size_t side = 0; side < 2; ++side) {
    plant::LoopModel part = model;
    draw_disturbance(random, part, hours);
    part.scenario.seed = 100 * seed + side;
    std::array<double, 2> rms{};
    Record made;
    for (std::size_t k = 0; k < 2; ++k) {
      part.controller.pid.gains = gains[k];
      Record record = simulated(part, hours);
      rms[k] = rms_of(record);
      if (k == side) made = std::move(record);
    }
    result.ratio *= std::sqrt(rms[1] / rms[0]);
    sides[side] = {
        .rms = rms[side],
        .by_model = analysis::compare_gains(
            {.period_s = model.sample_time_s, .pv = made.pv, .sp = made.sp, .co = made.co}, known,
            gains)};
  }
  result.found = analysis::judge_gains(sides[0], sides[1]);
  return result;
}

bool is_false(analysis::GainResult result, double ratio) {
  constexpr double kSame = 1.03;
  constexpr double kAlike = 1.25;
  switch (result) {
    case analysis::GainResult::improved: return ratio > 1.0 / kSame;
    case analysis::GainResult::worse: return ratio < kSame;
    case analysis::GainResult::no_difference: return std::max(ratio, 1.0 / ratio) > kAlike;
    case analysis::GainResult::cant_tell: break;
  }
  return false;
}

int run_gains(const ReceiptOptions& options) {
  std::vector<GainsCase> cases(options.cases);
  base::parallel_for(options.cases, options.threads, [&](std::size_t k) {
    cases[k] = run_gains_case(options.seed + k, options.hours);
  });
  std::array<std::size_t, 4> results{};
  std::size_t wrong = 0;
  for (const GainsCase& one : cases) {
    ++results[static_cast<std::size_t>(one.found.result)];
    wrong += is_false(one.found.result, one.ratio) ? 1U : 0U;
  }
  fmt::print("improved {:>4}  worse {:>4}  no difference {:>4}  can't tell {:>4}\n", results[0],
             results[1], results[2], results[3]);
  fmt::print("false receipts {} of {}\n", wrong, cases.size());
  if (!options.list) return kExitOk;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    fmt::print("{} ratio {:.2f}: {}, {}\n", options.seed + k, cases[k].ratio,
               analysis::to_text(cases[k].found.result), cases[k].found.why);
  }
  return kExitOk;
}

Case run_case(std::uint64_t seed, double hours) {
  Draw random(seed);
  const auto between = [&](double low, double high) { return random.between(low, high); };
  const plant::LoopModel model = drawn_loop(random);
  const bool sticks = random.uniform() < 0.7;
  Case one{.removed = random.uniform() < 0.5, .truth = sticks ? "stiction" : "backlash"};
  one.size = between(2.0, 8.0);
  const double jump = between(0.2, 0.8);
  const auto fault = [&](double size) -> std::vector<effects::EffectSpec> {
    if (sticks) return {{"stiction", {{"s", size}, {"j", size * jump}}}};
    return {{"backlash", {{"deadband", size}}}};
  };
  const auto record_with = [&](double size, std::uint64_t record_seed) {
    plant::LoopModel part = model;
    part.valve_effects = fault(size);
    draw_disturbance(random, part, hours);
    part.scenario.seed = record_seed;
    return judged(simulated(part, hours), model.sample_time_s);
  };
  const auto before = record_with(one.size, 100 * seed + 1);
  const double remains = one.removed ? between(0.0, 0.3) : one.size * between(0.8, 1.1);
  const auto after = record_with(remains, 100 * seed + 51);
  const diagnosis::Repair repair = diagnosis::judge_repair(before, after);
  one.result = repair.result;
  one.why = repair.why;
  one.found = repair.before.s;
  one.excluded = repair.excluded_nats;
  return one;
}

int run_receipt(const ReceiptOptions& options) {
  if (options.gains) return run_gains(options);
  std::vector<Case> cases(options.cases);
  base::parallel_for(options.cases, options.threads,
                     [&](std::size_t k) { cases[k] = run_case(options.seed + k, options.hours); });
  for (const bool removed : {true, false}) {
    std::array<std::size_t, 3> results{};
    for (const Case& one : cases)
      if (one.removed == removed) ++results[static_cast<std::size_t>(one.result)];
    fmt::print("{:<14} repaired {:>4}  not repaired {:>4}  can't tell {:>4}\n",
               removed ? "effect removed" : "effect remains", results[0], results[1], results[2]);
  }
  const auto wrong = std::count_if(cases.begin(), cases.end(), [](const Case& one) {
    return one.result == (one.removed ? RepairResult::not_repaired : RepairResult::repaired);
  });
  fmt::print("false receipts {} of {}\n", wrong, cases.size());
  if (!options.list) return kExitOk;
  for (std::size_t k = 0; k < cases.size(); ++k) {
    const Case& one = cases[k];
    fmt::print("{} {} {:.1f} (found {:.1f}) {}: {}, {:.1f} nats: {}\n", options.seed + k, one.truth,
               one.size, one.found, one.removed ? "removed" : "remains",
               diagnosis::to_text(one.result), one.excluded, one.why);
  }
  return kExitOk;
}

}  // namespace

void add_receipt(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<ReceiptOptions>();
  CLI::App* sub = app.add_subcommand(
      "receipt", "Count false receipts of repairs on simulated records before and after");
  sub->add_option("--cases", options->cases, "how many")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  sub->add_option("--seed", options->seed, "of the first case")->capture_default_str();
  sub->add_option("--hours", options->hours, "length of each record")
      ->check(CLI::Range(0.5, 100.0))
      ->capture_default_str();
  sub->add_flag("--gains", options->gains, "the work is a change of the gains");
  sub->add_flag("--list", options->list, "print each case");
  sub->add_option("--jobs", options->threads, "threads; the result does not depend on it")
      ->check(CLI::Range(1, 1024))
      ->capture_default_str();
  sub->footer("Example: loopwarden-study receipt --cases 200");
  sub->callback([options, &exit_code] { exit_code = run_receipt(*options); });
}

}  // namespace loopwarden::lab
