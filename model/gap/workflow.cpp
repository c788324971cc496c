// SPDX-License-Identifier: Apache-2.0
#include "model/gap/workflow.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <numbers>

#include "model/control/root_sum_square.hpp"
#include "model/gap/confidence.hpp"
#include "model/gap/controller_block.hpp"
#include "model/gap/locate.hpp"
#include "model/gap/record_check.hpp"
#include "model/plant/simulated_loop.hpp"

namespace loopwarden::gap {
namespace {

// NOLINTNEXTLINE(cert-dcl50-cpp): checked against its format by the compiler
[[gnu::format(printf, 1, 2)]] std::string text(const char* format, ...) {
  std::array<char, 512> out{};
  va_list values;
  va_start(values, format);
  std::vsnprintf(out.data(), out.size(), format, values);
  va_end(values);
  return out.data();
}

struct Range {
  std::size_t begin, end;
};

double rms(const std::vector<double>& a, const std::vector<double>& b,
           const std::vector<bool>& used, Range range) {
  double sum = 0.0;
  std::size_t count = 0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (!used[k]) continue;
    sum += (a[k] - b[k]) * (a[k] - b[k]);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : kNone;
}

double deviation(const std::vector<double>& v, const std::vector<bool>& used, Range range) {
  double mean = 0.0;
  double count = 0.0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (!used[k]) continue;
    mean += v[k];
    count += 1.0;
  }
  mean /= std::max(count, 1.0);
  double sum = 0.0;
  for (std::size_t k = range.begin; k < range.end; ++k) {
    if (used[k]) sum += (v[k] - mean) * (v[k] - mean);
  }
  return std::sqrt(sum / std::max(count, 1.0));
}

Misfit misfit_of(const std::vector<double>& pv, const std::vector<double>& simulated,
                 const std::vector<bool>& used, double floor) {
  const Range all{0, pv.size()};
  const Range training{0, training_samples(pv.size())};
  const Range holdout{training.end, pv.size()};
  Misfit m;
  m.rmse = rms(pv, simulated, used, all);
  m.training_rmse = rms(pv, simulated, used, training);
  m.holdout_rmse = rms(pv, simulated, used, holdout);
  const double moves = deviation(pv, used, all);
  const double holdout_moves = deviation(pv, used, holdout);
  if (moves >= 3.0 * floor) m.fit_percent = 100.0 * (1.0 - m.rmse / moves);
  if (holdout_moves >= 3.0 * floor) {
    m.holdout_fit_percent = 100.0 * (1.0 - m.holdout_rmse / holdout_moves);
  }
  return m;
}

// PV of the model's closed loop, driven by SP, from the measured first PV. Noise left out.
std::vector<double> closed_loop(const plant::LoopModel& model, const std::vector<double>& sp,
                                double first_pv) {
  plant::LoopModel quiet = model;
  quiet.transmitter.noise = 0.0;
  std::erase_if(quiet.disturbances,
                [](const plant::EffectSpec& spec) { return spec.name == "random_load"; });
  plant::Plant plant(quiet, 1);
  const double start = plant.output_for(first_pv);
  plant.reset(start);
  const control::PidSettings& settings = quiet.controller.pid;
  control::Pid pid(settings, quiet.sample_time_s);
  pid.initialise(start, first_pv, first_pv);
  std::vector<double> pv;
  double co = start;
  for (const double set_point : sp) {
    pv.push_back(plant.process_variable());
    co = std::clamp(pid.step(set_point, pv.back(), co, 0.0), settings.output_low,
                    settings.output_high);
    plant.step(co);
  }
  return pv;
}

// The set point where it was not measured: the scenario's profile, shifted to where PV agrees best
// with the model's closed loop; without one, the mean of the record's second half.
std::vector<double> assumed_set_point(const plant::LoopModel& model, const std::vector<double>& pv,
                                      std::vector<RecordNote>& notes) {
  const std::size_t n = pv.size();
  const auto& profile = model.scenario.set_point;
  if (profile.empty()) {
    double mean = 0.0;
    for (std::size_t k = n / 2; k < n; ++k) mean += pv[k] / static_cast<double>(n - n / 2);
    notes.push_back(
        {"no set point", text("SP was not measured and the model has no scenario: %.4g, "
                              "the mean of PV's second half, stands for it",
                              mean)});
    return std::vector<double>(n, mean);
  }
  const auto shifted = [&](double shift_s) {
    std::vector<double> sp(n, profile.front().second);
    for (std::size_t k = 0; k < n; ++k) {
      for (const auto& [time_s, value] : profile) {
        if (static_cast<double>(k) * model.sample_time_s + 1e-9 >= time_s + shift_s) sp[k] = value;
      }
    }
    return sp;
  };
  double best_shift_s = 0.0;
  double best = -1.0;
  for (int i = -100; i <= 100; ++i) {
    const double shift_s = i * model.sample_time_s;
    const std::vector<double> simulated = closed_loop(model, shifted(shift_s), pv.front());
    double sum = 0.0;
    for (std::size_t k = 0; k < n; ++k) sum += (pv[k] - simulated[k]) * (pv[k] - simulated[k]);
    if (best < 0.0 || sum < best) {
      best = sum;
      best_shift_s = shift_s;
    }
  }
  notes.push_back(
      {"no set point", text("SP was not measured: the scenario's profile, %.3g s later, "
                            "stands for it",
                            best_shift_s)});
  return shifted(best_shift_s);
}

std::map<std::string, std::array<double, 2>> intervals(const Fit& fit, std::size_t index,
                                                       const Fitter& fitter,
                                                       const plant::EffectSpec& spec) {
  constexpr double k95 = 1.96;
  const std::vector<double> spread = fitter.spread(fit, index);
  const Candidate& term = *fit.terms[index];
  const std::vector<double>& searched = fit.point.searched[index];
  std::map<std::string, double> deviations;
  for (std::size_t j = 0; j < term.search.size(); ++j) deviations[term.search[j].name] = spread[j];
  switch (term.kind) {
    case Kind::stiction:
      deviations["j"] = control::root_sum_square(searched[1] * spread[0], searched[0] * spread[1]);
      break;
    case Kind::cam_obstruction:
      deviations["jump"] =
          control::root_sum_square(searched[2] * spread[1], searched[1] * spread[2]);
      break;
    case Kind::gain_change: deviations["factor"] = spread[0]; break;
    case Kind::output_bias: deviations["bias"] = spread[0]; break;
    case Kind::drift: deviations["rate"] = spread[0]; break;
    case Kind::step_disturbance: deviations["size"] = spread[1]; break;
    case Kind::oscillating_disturbance: {
      deviations["amplitude"] = std::max(spread[1], spread[2]);
      const double amplitude = spec.parameters.at("amplitude");
      deviations["phase"] =
          amplitude > 0.0 ? deviations["amplitude"] / amplitude : std::numbers::pi;
      break;
    }
    case Kind::backlash:
    case Kind::hysteresis_width:
    case Kind::hysteresis_offset:
    case Kind::low_air_supply:
    case Kind::equal_percentage:
    case Kind::quick_opening:
    case Kind::butterfly:
    case Kind::curve_table:
    case Kind::positioner_overshoot:
    case Kind::extra_dead_time:
    case Kind::extra_lag: break;  // what is searched is what is named
  }
  std::map<std::string, std::array<double, 2>> out;
  for (const auto& [name, value] : spec.parameters) {
    const auto it = deviations.find(name);
    if (it != deviations.end()) {
      out[name] = {value - k95 * it->second, value + k95 * it->second};
    }
  }
  return out;
}

std::string parameters_text(const plant::EffectSpec& spec) {
  std::string out;
  const auto curve = spec.options.find("curve");
  if (curve != spec.options.end()) out = curve->second;
  for (const auto& [name, value] : spec.parameters) {
    // How the stem answers to its actuator is part of the law, not what an engineer asks for.
    if (spec.name == "stiction" && name != "s" && name != "j") continue;
    out += (out.empty() ? "" : ", ") + name + " " + text("%.3g", value);
  }
  return out;
}

plant::EffectSpec spec_of(const FreeRun& run, const Fit& fit, std::size_t index) {
  const plant::LoopModel model = run.corrected(fit.terms, fit.point, fit.solved);
  const char* name = fit.terms[index]->name;
  for (const auto* list : {&model.valve_effects, &model.process_effects, &model.transmitter_effects,
                           &model.disturbances}) {
    for (auto it = list->rbegin(); it != list->rend(); ++it) {
      if (it->name == name) return *it;
    }
  }
  return {};
}

void add_controller(Result& result, const ControllerFinding& controller,
                    const plant::LoopModel& model) {
  if (!controller.mismatch) return;
  FoundEffect effect;
  effect.spec = {"controller_mismatch", {{"kp", controller.kp}, {"ki", controller.ki}}};
  effect.block = plant::Block::controller;
  effect.confidence = controller_confidence();
  effect.interval["kp"] = {controller.kp - 1.96 * controller.kp_spread,
                           controller.kp + 1.96 * controller.kp_spread};
  effect.interval["ki"] = {controller.ki - 1.96 * controller.ki_spread,
                           controller.ki + 1.96 * controller.ki_spread};
  effect.evidence = text(
      "replayed on the measured SP and PV, the model's controller misses CO by %.3g; "
      "with kp %.4g and ki %.4g (model: %.4g and %.4g) by %.2g",
      controller.before_rmse, controller.kp, controller.ki, model.controller.pid.gains.kp,
      model.controller.pid.gains.ki, controller.after_rmse);
  result.effects.push_back(std::move(effect));
  result.corrected.controller.pid.gains.kp = controller.kp;
  result.corrected.controller.pid.gains.ki = controller.ki;
}

std::string why_not(const Hypothesis& tried, const SearchResult& search, const Result& result) {
  if (result.verdict == Verdict::no_gap) return "nothing is missing that it could explain";
  const double behind = search.chosen.score - tried.score;
  if (search.chosen.fit.terms.empty()) {
    return text("explains too little: %.3g of the gap's rmse %.3g is left", tried.training_rmse,
                search.base_rmse);
  }
  if (behind < 6.0) return text("can't be told apart here: only %.1f nats behind", behind);
  return text("leaves an rmse of %.3g where the choice leaves %.3g; %.0f nats less likely",
              tried.training_rmse, search.chosen.training_rmse, behind);
}

void name_effects(Result& result, const SearchResult& search, const Fitter& fitter,
                  const FreeRun& run, const Residuals& left) {
  const Fit& fit = search.chosen.fit;
  for (std::size_t i = 0; i < fit.terms.size(); ++i) {
    FoundEffect effect;
    effect.spec = spec_of(run, fit, i);
    effect.block = fit.terms[i]->block;
    effect.interval = intervals(fit, i, fitter, effect.spec);
    effect.confidence = confidence(search.margins[i], left.adequate);
    effect.lead_nats = search.margins[i];
    for (const Hypothesis& h : search.tried) {
      if (h.fit.terms.size() != fit.terms.size() || contains(h.fit, fit.terms[i]->name)) continue;
      if (search.chosen.score - h.score > 6.0) continue;
      for (const Candidate* term : h.fit.terms) {
        const std::string name = term->name;
        if (!contains(fit, name) &&
            std::find(effect.alternatives.begin(), effect.alternatives.end(), name) ==
                effect.alternatives.end()) {
          effect.alternatives.push_back(name);
        }
      }
    }
    effect.evidence = text(
        "with it (%s) the free run's rmse falls from %.3g to %.3g on the data of the fit; the best "
        "explanation without it is %.0f nats less likely",
        parameters_text(effect.spec).c_str(), search.base_rmse, search.chosen.training_rmse,
        search.margins[i]);
    result.effects.push_back(std::move(effect));
  }
}

// Whether the chosen hypothesis predicts the holdout no worse than the model alone, a load allowed to
// both. (What shows only before the holdout can't be better there.)
bool holds(const Fitter& whole, const SearchResult& search, std::size_t training_end,
           const std::vector<bool>& used) {
  Fit base = search.base;
  base.load = search.chosen.fit.load;
  const auto first =
      std::count(used.begin(), used.begin() + static_cast<std::ptrdiff_t>(training_end), true);
  const auto sum = [&](const Fit& fit) {
    const std::vector<double> e = whole.innovations(fit);
    double squares = 0.0;
    for (auto i = static_cast<std::size_t>(first); i < e.size(); ++i) squares += e[i] * e[i];
    return squares * fit.noise_rms * fit.noise_rms;
  };
  return sum(search.chosen.fit) < 1.05 * sum(base);
}

std::string sentence_of(const Result& r) {
  if (r.verdict == Verdict::no_gap) {
    return text(
        "The model explains the record: what is left, %.3g rms, is %s.", r.before.rmse,
        r.load_intensity > 0.0 ? "noise and an unmeasured load" : "the noise of the record");
  }
  if (r.verdict == Verdict::unexplained) {
    return text(
        "Model and record disagree by %.3g rms, and no effect that is known here explains it.",
        r.before.rmse);
  }
  std::string names;
  for (std::size_t i = 0; i < r.effects.size(); ++i) {
    names += i == 0 ? "" : i + 1 == r.effects.size() ? " and " : ", ";
    names += r.effects[i].spec.name + " (" + parameters_text(r.effects[i].spec) + ")";
  }
  if (r.closed_loop && !(r.after.holdout_rmse < r.before.holdout_rmse)) {
    return text(
        "The model lacks %s. Without CO the closed loop runs free and does not keep the phase of a "
        "cycle: its misfit can't show that, the evidence from the replayed controller does.",
        names.c_str());
  }
  return text(
      "The model lacks %s: with it the misfit on data the fit never saw falls from %.3g to %.3g.",
      names.c_str(), r.before.holdout_rmse, r.after.holdout_rmse);
}

// How far from CO the stem of the model's valve can rest, CO units.
double resting_band(const plant::LoopModel& model) {
  double band = 0.0;
  const auto value = [](const plant::EffectSpec& spec, const char* key) {
    const auto it = spec.parameters.find(key);
    return it != spec.parameters.end() ? it->second : 0.0;
  };
  for (const plant::EffectSpec& spec : model.valve_effects) {
    if (spec.name == "stiction") band += (value(spec, "s") + value(spec, "j")) / 2.0;
    if (spec.name == "backlash") band += value(spec, "deadband") / 2.0;
    if (spec.name == "hysteresis") band += value(spec, "width") / 2.0;
  }
  return band;
}

}  // namespace

std::vector<double> free_run(const plant::LoopModel& model, const std::vector<double>& co,
                             const std::vector<double>& pv, const std::vector<bool>& used,
                             double start_offset) {
  const FreeRun run(model, co);
  const Range training{0, training_samples(co.size())};
  std::vector<std::vector<double>> columns;
  // From a stem that rests `below_co` below CO.
  const auto from = [&](double below_co) {
    Point point;
    point.time_constant_s = model.process.time_constant_s;
    point.dead_time_s = model.process.dead_time_s;
    point.start_offset = below_co;
    run.columns({}, point, columns);
    // The process's state at the start, from the samples that still remember it.
    const double memory_s = point.dead_time_s + 6.0 * point.time_constant_s;
    const std::size_t head =
        std::min(co.size(), static_cast<std::size_t>(memory_s / model.sample_time_s) + 2);
    Eigen::Matrix2d normal = Eigen::Matrix2d::Identity() * 1e-6;
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t k = 0; k < head; ++k) {
      if (!used[k]) continue;
      const Eigen::Vector2d row(columns[1][k], columns[2][k]);
      normal += row * row.transpose();
      right += row * (pv[k] - run.offset()[k] - columns[0][k]);
    }
    const Eigen::Vector2d past = normal.ldlt().solve(right);
    std::vector<double> out = run.offset();
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] += columns[0][k] + past(0) * columns[1][k] + past(1) * columns[2][k];
    }
    return out;
  };
  std::vector<double> best = from(0.0);
  const double band = resting_band(model);
  if (band <= 0.0) return best;
  double best_rms = rms(pv, best, used, training);
  double best_place = 0.0;
  const auto offer = [&](double place) {
    std::vector<double> tried = from(band * place);
    const double tried_rms = rms(pv, tried, used, training);
    if (!(tried_rms < best_rms)) return;
    best_rms = tried_rms;
    best_place = place;
    best = std::move(tried);
  };
  offer(start_offset / band);
  constexpr int kPlaces = 12;  // to each side of CO
  for (int i = -kPlaces; i <= kPlaces; ++i) offer(static_cast<double>(i) / kPlaces);
  for (double step = 0.5 / kPlaces; step > 0.02 / kPlaces; step /= 2.0) {
    const double around = best_place;
    if (around - step >= -1.0) offer(around - step);
    if (around + step <= 1.0) offer(around + step);
  }
  return best;
}

Result find_gap(const Record& given, const plant::LoopModel& given_model, const Options& options,
                const ParallelFor& parallel, const std::function<void(double)>& progress) {
  Result result;
  result.model = given_model;
  result.corrected = given_model;
  Record record = believed(given, given_model);
  result.check = check_record(record, given_model);
  if (!result.check.usable) return result;

  plant::LoopModel model = given_model;
  model.sample_time_s = record.period_s;
  model.transmitter.noise = 0.0;
  model.transmitter.resolution = 0.0;
  const std::size_t n = record.size();
  const std::vector<double> pv = held(record.pv);
  std::vector<double> sp;
  if (record.has_sp()) sp = held(record.sp);
  if (!record.has_co()) {
    result.closed_loop = true;
    if (sp.empty()) sp = assumed_set_point(model, pv, result.check.notes);
    plant::Plant rest(model, 1);
    record.co = replay_controller(model.controller.pid, model.sample_time_s, sp, pv,
                                  rest.output_for(pv.front()));
    result.check.notes.push_back(
        {"no output",
         "CO was not measured: the model's controller, replayed on SP and PV, stands for it"});
  }
  const std::vector<double> co = held(record.co);
  const ControllerFinding controller =
      result.closed_loop ? ControllerFinding{} : compare_controller(record, model);
  if (controller.compared) {
    result.controller_before_rmse = controller.before_rmse;
    result.controller_after_rmse = controller.after_rmse;
    if (!controller.anti_windup.empty()) {
      result.check.notes.push_back(
          {"anti-windup",
           "near its limits CO behaves as with anti_windup: " + controller.anti_windup});
    }
  }
  const std::vector<bool> used = usable_samples(record, model);
  const std::size_t end = training_samples(n);
  result.holdout_from_s = record.time_s(end);
  std::vector<bool> training(used.begin(), used.end());
  std::fill(training.begin() + static_cast<std::ptrdiff_t>(end), training.end(), false);

  const FreeRun run(model, co, !result.closed_loop);
  const double pv_span = model.transmitter.high - model.transmitter.low;
  const double largest_ratio =
      options.search.load && result.check.noise_rms > 0.0
          ? options.largest_load * pv_span * std::sqrt(record.period_s) / result.check.noise_rms
          : 0.0;
  const Fitter fitter(run, pv, training, largest_ratio, options.search.allowances);
  const auto [co_low, co_high] =
      std::minmax_element(co.begin(), co.begin() + static_cast<std::ptrdiff_t>(end));
  std::vector<Candidate> all = candidates({.output_low = model.controller.pid.output_low,
                                           .output_high = model.controller.pid.output_high,
                                           .output_used_low = *co_low,
                                           .output_used_high = *co_high,
                                           .period_s = record.period_s,
                                           .duration_s = record.time_s(end),
                                           .time_constant_s = model.process.time_constant_s,
                                           .dead_time_s = model.process.dead_time_s});
  if (*co_high - *co_low <
      kLeastMovement * (model.controller.pid.output_high - model.controller.pid.output_low)) {
    // A valve that is never moved shows nothing of itself, nor of the process.
    std::erase_if(all, [](const Candidate& candidate) {
      return candidate.block == plant::Block::valve || candidate.block == plant::Block::process;
    });
  }
  if (result.closed_loop) {
    std::erase_if(all, [](const Candidate& c) { return c.kind == Kind::output_bias; });
  }
  const double least_rms = std::max(0.0015 * pv_span, 0.5 * result.check.noise_rms);
  const SearchResult search =
      search_effects(fitter, all, least_rms, options.search, parallel, progress);

  // What the chosen hypothesis leaves, and whether noise and a quiet load account for it.
  const Residuals left = examine(fitter, search, co, result.check.noise_rms, record.period_s);
  result.load_intensity = left.load_intensity;
  result.noise_floor_rmse = left.floor_rmse;
  result.rest = {.is_noise = left.adequate,
                 .noise_ratio = left.noise_ratio,
                 .kurtosis = left.tail,
                 .answer_to_co = left.answer,
                 .closed = left.closed};

  const auto simulated = [&](const plant::LoopModel& m, const Fit& fit) {
    return result.closed_loop ? closed_loop(m, sp, pv.front())
                              : free_run(m, co, pv, used, run.start_offset(fit.terms, fit.point));
  };
  Series& s = result.series;
  for (std::size_t k = 0; k < n; ++k) s.time_s.push_back(record.time_s(k));
  s.pv = record.pv;
  if (given.has_sp()) s.sp = given.sp;
  s.co = given.has_co() ? given.co : co;
  if (Record::has_value(given.stem)) s.stem = given.stem;
  s.co_before = controller.before;
  s.co_after = controller.after;
  s.pv_before = simulated(model, search.base);
  result.before = misfit_of(pv, s.pv_before, used, result.noise_floor_rmse);

  add_controller(result, controller, given_model);
  // Load counts as floor only where a quiet one accounts for what is left.
  const double floor = left.adequate ? left.floor_rmse : 1.5 * result.check.noise_rms;
  // What the model's own uncertainty covers is no gap.
  const bool material = search.base_rmse > control::root_sum_square(floor, least_rms);
  const bool named = !search.chosen.fit.terms.empty() && left.believable;
  if (named) {
    name_effects(result, search, fitter, run, left);
    plant::LoopModel corrected =
        run.corrected(search.chosen.fit.terms, search.chosen.fit.point, search.chosen.fit.solved);
    corrected.transmitter = given_model.transmitter;
    corrected.controller = result.corrected.controller;
    result.corrected = corrected;
  }
  plant::LoopModel after_model = result.corrected;
  after_model.transmitter.noise = 0.0;
  after_model.transmitter.resolution = 0.0;
  s.pv_after = simulated(after_model, search.chosen.fit);
  result.after = misfit_of(pv, s.pv_after, used, result.noise_floor_rmse);

  bool refuted = false;
  if (named) {
    // The holdout may only take back what the first two thirds gave.
    refuted = left.adequate
                  ? !holds(Fitter(run, pv, used, largest_ratio, options.search.allowances), search,
                           end, used)
                  : result.after.holdout_rmse > 0.8 * result.before.holdout_rmse;
  }
  const bool has_effects = !result.effects.empty();
  if (has_effects && !refuted) {
    result.verdict = Verdict::missing_effect;
  } else if (refuted || controller.unexplained || (material && !left.adequate) ||
             (!search.chosen.fit.terms.empty() && !left.believable && material)) {
    result.verdict = Verdict::unexplained;
  }
  if (refuted) {
    result.effects.clear();
    result.corrected = given_model;
    s.pv_after = s.pv_before;
    result.after = result.before;
    result.check.notes.push_back(
        {"holdout", "the best explanation of the first two thirds fails on the last third",
         result.holdout_from_s, record.time_s(n - 1)});
  }

  // Steps: the model's own tolerance, then one effect after another.
  if (result.verdict == Verdict::missing_effect) {
    std::vector<std::string> before;
    for (const std::vector<std::string>& names : search.path) {
      const auto hypothesis =
          std::find_if(search.tried.begin(), search.tried.end(), [&](const Hypothesis& h) {
            return h.fit.terms.size() == names.size() &&
                   std::all_of(names.begin(), names.end(),
                               [&](const std::string& name) { return contains(h.fit, name); });
          });
      const Fit& fit =
          names.size() == search.chosen.fit.terms.size() || hypothesis == search.tried.end()
              ? search.chosen.fit
              : hypothesis->fit;
      plant::LoopModel step_model = run.corrected(fit.terms, fit.point, fit.solved);
      const Misfit misfit =
          misfit_of(pv, simulated(step_model, fit), used, result.noise_floor_rmse);
      for (const std::string& name : before) {
        if (std::find(names.begin(), names.end(), name) == names.end()) {
          result.steps.push_back({"-" + name, misfit.training_rmse, misfit.holdout_rmse});
        }
      }
      for (const std::string& name : names) {
        if (std::find(before.begin(), before.end(), name) == before.end()) {
          result.steps.push_back({name, misfit.training_rmse, misfit.holdout_rmse});
        }
      }
      before = names;
    }
  }
  for (const Hypothesis& h : search.singles) {
    TriedCandidate tried;
    tried.name = h.fit.terms[0]->name;
    tried.block = h.fit.terms[0]->block;
    tried.spec = spec_of(run, h.fit, 0);
    tried.rmse = h.training_rmse;
    tried.score = h.score;
    tried.chosen =
        result.verdict == Verdict::missing_effect && contains(search.chosen.fit, tried.name);
    if (!tried.chosen) tried.why_not = why_not(h, search, result);
    result.candidates.push_back(std::move(tried));
  }
  if (result.verdict != Verdict::no_gap) {
    // What each effect alone accounts for: how much worse the whole is without it.
    std::vector<double> energy;
    if (named && !refuted) {
      const std::vector<double> whole = fitter.simulate(search.chosen.fit);
      for (std::size_t i = 0; i < search.chosen.fit.terms.size(); ++i) {
        if (search.chosen.fit.terms.size() == 1) {
          energy.push_back(1.0);
          continue;
        }
        const std::vector<double> without =
            fitter.simulate(fitter.fit_without(search.chosen.fit, i, 60));
        const double apart = rms(whole, without, used, {0, end});
        energy.push_back(apart * apart);
      }
    }
    locate(result, controller, energy);
  }
  result.sentence = sentence_of(result);
  return result;
}

}  // namespace loopwarden::gap
