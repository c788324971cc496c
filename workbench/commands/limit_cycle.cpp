// SPDX-License-Identifier: Apache-2.0
// loopwarden limit-cycle: compares the describing function's prediction for a loop with a
// simulation.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "model/analysis/limit_cycle.hpp"
#include "model/analysis/loop_metrics.hpp"
#include "model/analysis/tuning_rules.hpp"
#include "model/numeric/statistics.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/report/chart.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/text/json_number.hpp"
#include "model/analysis/loop_trial.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

struct LimitCycleOptions {
  std::string model;
  std::string out;
  std::optional<double> s, j, backlash;
  bool grid = false;
  bool json = false;
};

struct Simulated {
  bool cycles = false;
  double co_amplitude = 0.0;  // CO units
  double pv_amplitude = 0.0;  // PV units, half of PV's range
  double period_s = 0.0;
};

// Simulates the model's loop with this valve, without noise and converter steps, after a set-point
// step.
Simulated simulate_cycle(plant::LoopModel model, const analysis::ValveNonlinearity& valve) {
  model.scenario.faults.clear();
  std::erase_if(model.valve_effects, [](const effects::EffectSpec& spec) {
    return analysis::is_valve_nonlinearity(spec.name);
  });
  effects::EffectSpec spec{.name = valve.backlash ? "backlash" : "stiction"};
  if (valve.backlash) {
    spec.parameters = {{"deadband", valve.s}};
  } else {
    spec.parameters = {{"s", valve.s}, {"j", valve.j}};
  }
  model.valve_effects.push_back(spec);
  model.transmitter.noise = 0.0;
  model.transmitter.resolution = 0.0;
  const double span = model.transmitter.span();
  const double middle = model.transmitter.low + 0.5 * span;
  model.scenario.set_point = {{0.0, middle - 0.1 * span}, {10.0 * model.sample_time_s, middle}};
  const analysis::LinearLoop linear = analysis::linear_loop(model);
  double answer_s = linear.dead_time_s;
  for (const double lag : linear.lags_s) answer_s += lag;
  if (model.controller.pid.gains.ki > 0.0) {
    answer_s += 1.0 / (model.controller.pid.gains.ki * linear.gain);
  }
  // Slow cycles take about 2 S / (ki K J). A sixth of the run contains about ten of them.
  const double slow_s =
      valve.backlash ? 0.0 : 2.0 * valve.s / std::max(valve.j, 0.02 * valve.s) * answer_s;
  const double duration_s = std::clamp(60.0 * (answer_s + slow_s), 0.0, 2e6 * model.sample_time_s);
  const analysis::SimulatedRecord r = analysis::run_model(model, duration_s);
  const auto tail = [&](const std::vector<double>& column) {
    return std::vector<double>(column.end() - static_cast<std::ptrdiff_t>(column.size() / 2),
                               column.end());
  };
  const std::vector<double> pv = tail(r.true_pv);
  const std::vector<double> co = tail(r.co);
  const auto half_range = [](const std::vector<double>& values) {
    const auto [least, most] = std::minmax_element(values.begin(), values.end());
    return (*most - *least) / 2.0;
  };
  Simulated s{.co_amplitude = half_range(co), .pv_amplitude = half_range(pv)};
  // A decaying oscillation is not a limit cycle.
  const std::vector<double> last(pv.end() - static_cast<std::ptrdiff_t>(pv.size() / 3), pv.end());
  s.cycles =
      half_range(last) > 0.02 * linear.gain * valve.s && half_range(last) > 0.5 * s.pv_amplitude;
  const analysis::LoopMetrics m =
      analysis::loop_metrics(tail(r.sp), pv, {}, model.sample_time_s, 0.0);
  s.period_s = m.period_s;
  return s;
}

struct Row {
  std::string plant;
  analysis::ValveNonlinearity valve;
  std::optional<analysis::LimitCycle> predicted;  // stable
  Simulated simulated;
  bool out_of_reach = false;  // -1/N begins beyond the axis crossing of L: no prediction possible
};

std::optional<analysis::LimitCycle> stable_cycle(const std::vector<analysis::LimitCycle>& cycles) {
  for (const analysis::LimitCycle& cycle : cycles) {
    if (cycle.stable) return cycle;
  }
  return std::nullopt;
}

Row compared(const std::string& name, const plant::LoopModel& model,
             const analysis::ValveNonlinearity& valve) {
  const analysis::LinearLoop loop = analysis::linear_loop(model);
  const analysis::AxisReach reach = analysis::axis_reach(loop, valve);
  return {name, valve, stable_cycle(limit_cycles(loop, valve)), simulate_cycle(model, valve),
          reach.loop < reach.valve && std::isfinite(reach.valve)};
}

// Simulates the model's loop with its own settings and those of the rules, with several kinds of
// valves.
std::vector<Row> grid_of(const plant::LoopModel& model) {
  std::vector<Row> rows;
  const double span = model.controller.pid.output_span();
  std::vector<std::pair<std::string, control::PidGains>> tunings{
      {"its own", model.controller.pid.gains}};
  using analysis::TuningRule;
  for (const TuningRule rule :
       {TuningRule::zn, TuningRule::amigo, TuningRule::simc, TuningRule::cohen_coon}) {
    if (const auto gains = analysis::tune(rule, model.process)) {
      tunings.emplace_back(analysis::to_text(rule), *gains);
    }
  }
  for (const auto& [name, gains] : tunings) {
    plant::LoopModel tuned = model;
    tuned.controller.pid.gains = gains;
    for (const double share : {0.02, 0.1}) {
      const double s = share * span;
      for (const double j : {0.1, 0.3, 0.6, 1.0}) {
        rows.push_back(compared(name, tuned, {false, s, j * s}));
      }
      rows.push_back(compared(name, tuned, {true, s, 0.0}));
    }
  }
  return rows;
}

std::string pair_text(double predicted, double simulated) {
  return fmt::format("{:>9.4g} {:>9.4g} {:>6.2f}", predicted, simulated, predicted / simulated);
}

void print_grid(const std::vector<Row>& rows) {
  fmt::print("{:<12} {:<24} {:>28} {:>28} {:>28}\n", "", "", "period, s", "PV amplitude, PV units",
             "CO amplitude, CO units");
  fmt::print("{:<12} {:<24} {:>9} {:>9} {:>6}   {:>9} {:>9} {:>6}   {:>9} {:>9} {:>6}\n", "loop",
             "valve", "predicted", "simulated", "ratio", "predicted", "simulated", "ratio",
             "predicted", "simulated", "ratio");
  std::size_t agree = 0;
  std::size_t missed = 0;
  std::size_t out_of_reach = 0;
  for (const Row& row : rows) {
    const std::string valve = row.valve.backlash
                                  ? fmt::format("backlash {:g}", row.valve.s)
                                  : fmt::format("stiction S {:g} J {:g}", row.valve.s, row.valve.j);
    agree += row.predicted.has_value() == row.simulated.cycles ? 1U : 0U;
    if (!row.predicted && row.simulated.cycles) {
      ++missed;
      out_of_reach += row.out_of_reach ? 1U : 0U;
    }
    if (row.predicted && row.simulated.cycles) {
      fmt::print("{:<12} {:<24} {}   {}   {}\n", row.plant, valve,
                 pair_text(row.predicted->period_s, row.simulated.period_s),
                 pair_text(row.predicted->pv_amplitude, row.simulated.pv_amplitude),
                 pair_text(row.predicted->co_amplitude, row.simulated.co_amplitude));
    } else {
      fmt::print("{:<12} {:<24} predicted: {}, simulated: {}\n", row.plant, valve,
                 row.predicted ? "cycle" : "none", row.simulated.cycles ? "cycle" : "none");
    }
  }
  const auto spread = [&](auto value) {
    std::vector<double> ratios;
    for (const Row& row : rows) {
      if (row.predicted && row.simulated.cycles) ratios.push_back(value(row));
    }
    std::sort(ratios.begin(), ratios.end());
    return ratios.empty() ? std::string("-")
                          : fmt::format("{:.2f} ({:.2f} to {:.2f})", numeric::median(ratios),
                                        ratios.front(), ratios.back());
  };
  fmt::print(
      "\nWhether it cycles: {} of {} as predicted. Simulated cycles without a predicted one: {}, "
      "of them {} with L(jw)\ncrossing the negative imaginary axis below pi S/(4 J), where -1/N "
      "begins. Predicted over simulated, median (least to largest):\n  period {}\n  PV amplitude "
      "{}\n  CO amplitude {}\n",
      agree, rows.size(), missed, out_of_reach,
      spread([](const Row& r) { return r.predicted->period_s / r.simulated.period_s; }),
      spread([](const Row& r) { return r.predicted->pv_amplitude / r.simulated.pv_amplitude; }),
      spread([](const Row& r) { return r.predicted->co_amplitude / r.simulated.co_amplitude; }));
}

nlohmann::json as_json(const Row& row) {
  nlohmann::json result = {
      {"loop", row.plant},    {"effect", row.valve.backlash ? "backlash" : "stiction"},
      {"s", row.valve.s},     {"j", row.valve.j},
      {"predicted", nullptr}, {"simulated", nullptr}};
  if (row.predicted) {
    result["predicted"] = {{"period_s", row.predicted->period_s},
                           {"pv_amplitude", row.predicted->pv_amplitude},
                           {"co_amplitude", row.predicted->co_amplitude}};
  }
  if (row.simulated.cycles) {
    result["simulated"] = {{"period_s", row.simulated.period_s},
                           {"pv_amplitude", row.simulated.pv_amplitude},
                           {"co_amplitude", row.simulated.co_amplitude}};
  }
  return result;
}

std::string nyquist(const analysis::LinearLoop& loop, const analysis::ValveNonlinearity& valve,
                    const std::vector<analysis::LimitCycle>& cycles) {
  Chart chart{.title = "Nyquist curve and -1/N",
              .x_label = "real",
              .y_label = "imaginary",
              .width = 620.0,
              .height = 560.0};
  ChartLine l{"open loop L(jw)", palette::kBlue, {}, {}};
  for (const double w : analysis::frequencies(loop, 3000)) {
    const std::complex<double> value = loop.open_loop(w);
    l.x.push_back(value.real());
    l.y.push_back(value.imag());
  }
  ChartLine n{"-1/N, growing amplitude towards -1", palette::kVermilion, {}, {}};
  for (const analysis::CriticalPoint& point : analysis::critical_locus(valve, 200.0, 400)) {
    n.x.push_back(point.value.real());
    n.y.push_back(point.value.imag());
  }
  ChartLine critical{"-1", palette::kInk, {-1.0}, {0.0}, false, true};
  double reach = 2.5;
  ChartLine stable{"limit cycle, stable", palette::kGreen, {}, {}, false, true};
  ChartLine unstable{"limit cycle, unstable", palette::kPurple, {}, {}, false, true};
  for (const analysis::LimitCycle& cycle : cycles) {
    const std::complex<double> at = -1.0 / valve.describing_function(cycle.co_amplitude);
    ChartLine& line = cycle.stable ? stable : unstable;
    line.x.push_back(at.real());
    line.y.push_back(at.imag());
    reach = std::max(reach, 1.3 * std::abs(at));
  }
  chart.lines = {l, n, critical};
  if (!stable.x.empty()) chart.lines.push_back(stable);
  if (!unstable.x.empty()) chart.lines.push_back(unstable);
  chart.x_range = PlotRange{-reach, 0.6 * reach};
  chart.y_range = PlotRange{-1.2 * reach, 0.25 * reach};
  return chart_svg(chart);
}

// Returns why the prediction missed a simulated cycle; empty in all other cases.
std::string missed_why(const analysis::AxisReach& reach, const Row& row) {
  if (row.predicted || !row.simulated.cycles) return {};
  if (reach.loop < reach.valve && std::isfinite(reach.valve)) {
    return fmt::format(
        "  Trust the simulation: the describing function assumes a sinusoidal CO, and here CO is a "
        "triangle with steps.\n  L(jw) crosses the negative imaginary axis at {:.3g}, below "
        "{:.3g} = pi S/(4 J), where -1/N begins.",
        reach.loop, reach.valve);
  }
  return "  Trust the simulation: the describing function assumes a sinusoidal CO.";
}

void print_one(const analysis::LinearLoop& loop, const analysis::Margins& m, const Row& row,
               const std::vector<analysis::LimitCycle>& cycles) {
  fmt::print("valve: {}\n",
             row.valve.backlash
                 ? fmt::format("backlash, dead band {:g} CO units", row.valve.s)
                 : fmt::format("stiction, stick band S {:g} CO units, jump J {:g} CO units",
                               row.valve.s, row.valve.j));
  if (row.simulated.cycles) {
    fmt::print(
        "simulation: limit cycle, period {:.4g} s, amplitude of PV {:.4g} PV units, of CO {:.4g} "
        "CO units\n",
        row.simulated.period_s, row.simulated.pv_amplitude, row.simulated.co_amplitude);
  } else {
    fmt::print("simulation: no limit cycle\n");
  }
  fmt::print(
      "linear loop: gain margin {:.3g}, phase margin {:.3g} deg, delay margin {:.3g} s, largest "
      "sensitivity (Ms) {:.3g}\n",
      m.gain_margin, m.phase_margin_deg, m.delay_margin_s, m.sensitivity);
  for (const std::string& name : loop.left_out) {
    if (analysis::is_valve_nonlinearity(name)) continue;
    fmt::print("not part of the linear loop: {}\n", name);
  }
  for (const analysis::LimitCycle& cycle : cycles) {
    fmt::print(
        "describing function: {} limit cycle, period {:.4g} s, amplitude of PV {:.4g} PV units, of "
        "CO {:.4g} CO units\n",
        cycle.stable ? "stable" : "unstable", cycle.period_s, cycle.pv_amplitude,
        cycle.co_amplitude);
  }
  if (cycles.empty()) fmt::print("describing function: no limit cycle\n");
  const std::string why = missed_why(analysis::axis_reach(loop, row.valve), row);
  if (!why.empty()) fmt::print("{}\n", why);
}

std::optional<analysis::ValveNonlinearity> wanted_valve(const LimitCycleOptions& options,
                                                        const plant::LoopModel& model) {
  if (options.backlash) return analysis::ValveNonlinearity{true, *options.backlash, 0.0};
  if (options.s) {
    return analysis::ValveNonlinearity{false, *options.s, options.j.value_or(0.3 * *options.s)};
  }
  return analysis::valve_nonlinearity(model);
}

int run_limit_cycle(const LimitCycleOptions& options) {
  const plant::LoopModel model = load_model(options.model);
  if (options.grid) {
    const std::vector<Row> rows = grid_of(model);
    if (!options.json) {
      print_grid(rows);
      return kExitOk;
    }
    nlohmann::json list = nlohmann::json::array();
    for (const Row& row : rows) list.push_back(as_json(row));
    show_json(list);
    return kExitOk;
  }
  const auto valve = wanted_valve(options, model);
  if (!valve) {
    fail(kExitUsage,
         "{}: has neither stiction nor backlash; name one with --s and --j, or --backlash",
         options.model);
  }
  const analysis::LinearLoop loop = analysis::linear_loop(model);
  const analysis::Margins m = analysis::margins(loop);
  const std::vector<analysis::LimitCycle> cycles = limit_cycles(loop, *valve);
  const Row row = compared("model", model, *valve);
  if (!options.out.empty()) {
    write_output(options.out, nyquist(loop, *valve, cycles), {options.model});
  }
  if (options.json) {
    nlohmann::json result = as_json(row);
    const analysis::AxisReach reach = analysis::axis_reach(loop, *valve);
    result["loop_crosses_axis_at"] = finite_or_null(reach.loop);
    result["valve_begins_at"] = finite_or_null(reach.valve);
    result["gain_margin"] = m.gain_margin;
    result["phase_margin_deg"] = m.phase_margin_deg;
    result["sensitivity"] = m.sensitivity;
    show_json(result);
  } else {
    print_one(loop, m, row, cycles);
  }
  return kExitOk;
}

}  // namespace

void add_limit_cycle(Program& program) {
  auto [command, o] = program.command(
      "limit-cycle", "Predict and simulate the limit cycle due to stiction or backlash",
      run_limit_cycle);
  command.required("model", o.model, "loop model, YAML");
  Option s =
      command.option("--s", o.s, "stick band S instead of the model's, CO units", above_zero());
  command.option("--j", o.j, "slip jump J, CO units; default: 0.3 S", not_below_zero()).needs(s);
  command
      .option("--backlash", o.backlash, "dead band of a backlash instead, CO units", above_zero())
      .excludes(s);
  command.flag("--grid", o.grid, "agreement over gains and valves");
  command.option("--out", o.out, "Nyquist picture to write, SVG");
  command.flag("--json", o.json, "print the result as JSON");
  command.footer(
      "Example: loopwarden limit-cycle examples/models/plant1.yaml --s 1 --j 0.4 --out "
      "nyquist.svg");
}

}  // namespace loopwarden::workbench
