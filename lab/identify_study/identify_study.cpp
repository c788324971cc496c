// SPDX-License-Identifier: Apache-2.0
// loopwarden-study identify: measures how often the intervals of `loopwarden identify` contain the
// truth.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "base/parallel.hpp"
#include "model/analysis/identification.hpp"
#include "lab/identify_study/identification_cases.hpp"
#include "lab/program/studies.hpp"

namespace loopwarden::lab {
namespace {

struct IdentifyStudyOptions {
  std::size_t cases = 100;
  std::uint64_t seed = 1;
  unsigned jobs = 0;
  std::optional<std::size_t> kind;
  bool each = false;
  bool json = false;
};

struct IdentifyCase {
  bool closed = false;
  bool told = false;
  bool form_right = false;
  double gain_error = 0.0;   // relative
  double gain_margin = 0.0;  // half of the interval, relative
  bool holds_gain = false, holds_lag = false, holds_dead = false;
  double seconds = 0.0;
  std::string text;
};

bool holds_truth(const analysis::Estimate& e, double truth) {
  return e.low <= truth && truth <= e.high;
}

IdentifyCase identify_case(CaseKind kind, std::uint64_t seed) {
  const IdentificationCase one = draw_case(kind, seed);
  const auto begin = std::chrono::steady_clock::now();
  const analysis::Identification found =
      analysis::identify({.period_s = one.period_s, .pv = one.pv, .sp = one.sp, .co = one.co});
  IdentifyCase r;
  r.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  r.closed = found.closed_loop;
  r.told = found.can_tell();
  const plant::ProcessParameters& t = one.truth;
  r.text = fmt::format(
      "{} seed {}: {} samples, truth gain {:.4g} T {:.4g} T2 {:.4g} L {:.4g} h {:.4g}: ",
      to_text(kind), seed, one.co.size(), t.gain, t.integrating() ? 0.0 : t.time_constant_s,
      t.second_time_constant_s, t.dead_time_s, one.period_s);
  if (!r.told) {
    r.text += found.reason;
    return r;
  }
  const analysis::ProcessFit& best = found.best();
  r.form_right = analysis::is_integrating(best.form) == t.integrating() &&
                 (best.second_lag_s.value > 0.0) == (t.second_time_constant_s > 0.0);
  r.gain_error = best.gain.value / t.gain - 1.0;
  r.gain_margin = (best.gain.high - best.gain.low) / 2.0 / std::abs(best.gain.value);
  r.holds_gain = holds_truth(best.gain, t.gain);
  r.holds_lag = t.integrating() || holds_truth(best.time_constant_s, t.time_constant_s);
  r.holds_dead = holds_truth(best.dead_time_s, t.dead_time_s);
  const auto show = [](const analysis::Estimate& e) {
    return fmt::format("{:.4g} [{:.4g}, {:.4g}]", e.value, e.low, e.high);
  };
  r.text += fmt::format("{}{}, noise {}, gain {}{} T {}{} T2 {} L {}{}, outside {:.2g}, {:.2f} s",
                        to_text(best.form), r.form_right ? "" : " (wrong)", best.noise_order,
                        show(best.gain), r.holds_gain ? "" : "!", show(best.time_constant_s),
                        r.holds_lag ? "" : "!", show(best.second_lag_s), show(best.dead_time_s),
                        r.holds_dead ? "" : "!", found.outside_margin, r.seconds);
  return r;
}

double percent_of(std::size_t hits, std::size_t of) {
  return of > 0 ? 100.0 * static_cast<double>(hits) / static_cast<double>(of) : std::nan("");
}

double middle_of(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

struct IdentifyRow {
  CaseKind kind = CaseKind::open_steps;
  std::size_t cases = 0, closed = 0, told = 0, form_right = 0, gain = 0, lag = 0, dead = 0;
  double bias = 0.0, error = 0.0, margin = 0.0, seconds = 0.0;
};

IdentifyRow row_of(CaseKind kind, const std::vector<IdentifyCase>& results) {
  IdentifyRow row{.kind = kind, .cases = results.size()};
  std::vector<double> errors, sizes, margins, seconds;
  for (const IdentifyCase& r : results) {
    row.closed += r.closed ? 1U : 0U;
    seconds.push_back(r.seconds);
    if (!r.told) continue;
    ++row.told;
    row.gain += r.holds_gain ? 1U : 0U;
    errors.push_back(r.gain_error);
    sizes.push_back(std::abs(r.gain_error));
    margins.push_back(r.gain_margin);
    if (!r.form_right) continue;
    ++row.form_right;
    row.lag += r.holds_lag ? 1U : 0U;
    row.dead += r.holds_dead ? 1U : 0U;
  }
  row.bias = middle_of(errors);
  row.error = middle_of(sizes);
  row.margin = middle_of(margins);
  row.seconds = middle_of(seconds);
  return row;
}

void print_identify_table(const std::vector<IdentifyRow>& rows) {
  fmt::print("{:<38}{:>6}{:>8}{:>8}{:>8}{:>10}{:>10}{:>10}{:>8}{:>8}{:>8}{:>8}\n", "", "loops",
             "closed", "can't", "form", "gain in", "T in", "L in", "bias", "error", "+-", "s");
  for (const IdentifyRow& r : rows) {
    fmt::print(
        "{:<38}{:>6}{:>7.0f}%{:>7.0f}%{:>7.0f}%{:>9.1f}%{:>9.1f}%{:>9.1f}%{:>7.1f}%{:>7.1f}%{:>7."
        "1f}%"
        "{:>8.2f}\n",
        to_text(r.kind), r.cases, percent_of(r.closed, r.cases),
        percent_of(r.cases - r.told, r.cases), percent_of(r.form_right, r.told),
        percent_of(r.gain, r.told), percent_of(r.lag, r.form_right),
        percent_of(r.dead, r.form_right), 100.0 * r.bias, 100.0 * r.error, 100.0 * r.margin,
        r.seconds);
  }
  fmt::print(
      "closed: taken for a closed loop. can't: no number given. form: number of lags and "
      "integrator right, of those given.\ngain in, T in, L in: the interval of 95 % contains the "
      "truth; T and L if the form is right. bias, error, "
      "+-: medians\nof the gain's error, its size, and half of the interval, of the gain. s: "
      "median time.\n");
}

void print_identify_json(const std::vector<IdentifyRow>& rows) {
  nlohmann::json list = nlohmann::json::array();
  for (const IdentifyRow& r : rows) {
    list.push_back({{"kind", to_text(r.kind)},
                    {"loops", r.cases},
                    {"closed", r.closed},
                    {"told", r.told},
                    {"form_right", r.form_right},
                    {"gain_in_interval", r.gain},
                    {"time_constant_in_interval", r.lag},
                    {"dead_time_in_interval", r.dead},
                    {"median_gain_bias", r.bias},
                    {"median_gain_error", r.error},
                    {"median_gain_margin", r.margin},
                    {"median_seconds", r.seconds}});
  }
  fmt::print("{}\n", list.dump(2));
}

int run_identify_study(const IdentifyStudyOptions& options) {
  const unsigned jobs =
      options.jobs > 0 ? options.jobs : std::max(1U, std::thread::hardware_concurrency());
  std::vector<IdentifyRow> rows;
  for (std::size_t i = 0; i < kCaseKinds.size(); ++i) {
    if (options.kind && *options.kind != i) continue;
    std::vector<IdentifyCase> results(options.cases);
    base::parallel_for(options.cases, jobs, [&](std::size_t k) {
      results[k] = identify_case(kCaseKinds[i], options.seed + k);
    });
    if (options.each) {
      for (const IdentifyCase& r : results) fmt::print("{}\n", r.text);
    }
    rows.push_back(row_of(kCaseKinds[i], results));
  }
  options.json ? print_identify_json(rows) : print_identify_table(rows);
  return kExitOk;
}

}  // namespace

void add_identify(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<IdentifyStudyOptions>();
  CLI::App* sub = app.add_subcommand("identify",
                                     "Measure how often the intervals of `loopwarden identify` "
                                     "contain the truth, on simulated loops");
  sub->add_option("--cases", options->cases, "loops of each kind")->capture_default_str();
  sub->add_option("--seed", options->seed, "of the first loop")->capture_default_str();
  sub->add_option("--kind", options->kind, "one kind only, by its row from 0");
  sub->add_option("--jobs", options->jobs, "threads; 0: one per core")->capture_default_str();
  sub->add_flag("--each", options->each, "a line for each loop before the table");
  sub->add_flag("--json", options->json, "print the result as JSON");
  sub->footer("Example: loopwarden-study identify --cases 100");
  sub->callback([options, &exit_code] { exit_code = run_identify_study(*options); });
}

}  // namespace loopwarden::lab
