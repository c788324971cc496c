// SPDX-License-Identifier: Apache-2.0
// loopwarden diagnose: what is wrong with a loop, from a routine record and no model.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "hal/record/record_csv.hpp"
#include "model/diagnosis/diagnosis.hpp"
#include "workbench/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using diagnosis::Cause;
using diagnosis::Diagnosis;
using diagnosis::Verdict;

struct DiagnoseOptions {
  std::string record;
  std::vector<double> co_range{0.0, 100.0};
  bool json = false;
};

double probability(const Diagnosis& d, Cause cause) {
  return d.probabilities[static_cast<std::size_t>(cause)];
}

double evidence(const Diagnosis& d, std::size_t index) { return d.findings.evidence[index]; }

// What speaks for the verdict, with the figures of this record.
std::string evidence_sentence(const Diagnosis& d) {
  using diagnosis::evidence_index;
  const auto percent = [&](std::size_t index) { return 100.0 * evidence(d, index); };
  switch (d.verdict) {
    case Verdict::valve_effect:
      return fmt::format(
          "in the runs of CO between its turning points {:.0f} % of PV's change comes within a "
          "seventh "
          "of the run, where CO makes {:.0f} % of its own; a process behind a valve with this "
          "effect "
          "explains {:.0f} % of PV's fast movement from CO, without it {:.0f} %",
          percent(evidence_index("pv_concentration")), percent(evidence_index("co_concentration")),
          100.0 * std::max(d.findings.fit.stiction.free, d.findings.fit.backlash.free),
          100.0 * d.findings.fit.linear.free);
    case Verdict::other_cause:
      if (d.cause == Cause::saturation) {
        return fmt::format("CO rests at its limit in {:.0f} % of the samples",
                           100.0 * d.prepared.share_at_limit);
      }
      return fmt::format(
          "from CO, a linear process explains {:.0f} % of PV's fast movement and one behind a "
          "valve "
          "with an effect {:.0f} %; shapes and timing speak against the valve",
          100.0 * d.findings.fit.linear.free,
          100.0 * std::max(d.findings.fit.stiction.free, d.findings.fit.backlash.free));
    case Verdict::healthy: return "no oscillation, and PV follows CO without dwelling";
    case Verdict::not_enough_data: return d.reason;
  }
  return {};
}

nlohmann::json effects_of(const Diagnosis& d, double span) {
  nlohmann::json effects = nlohmann::json::array();
  if (d.verdict != Verdict::valve_effect) return effects;
  nlohmann::json parameters;
  if (d.cause == Cause::stiction) {
    parameters = {{"s", d.s}, {"j", d.j}};
  } else {
    parameters = {{"deadband", d.s}};
  }
  nlohmann::json alternatives = nlohmann::json::array();
  if (d.alternative != Cause::none) alternatives.push_back(to_text(d.alternative));
  effects.push_back(
      {{"name", to_text(d.cause)},
       {"block", "valve"},
       {"parameters", parameters},
       {"percent_of_span", 100.0 * d.s / span},
       {"confidence", probability(d, d.cause)},
       {"alternatives", alternatives},
       {"interval", {{d.cause == Cause::stiction ? "s" : "deadband", {d.s_low, d.s_high}}}},
       {"evidence", evidence_sentence(d)}});
  return effects;
}

void print_json(const Diagnosis& d, const DiagnoseOptions& options) {
  nlohmann::json result = {{"verdict", to_text(d.verdict)},
                           {"effects", effects_of(d, options.co_range[1] - options.co_range[0])},
                           {"cause", nullptr},
                           {"oscillating", d.oscillating},
                           {"period_s", nullptr},
                           {"co_range", options.co_range},
                           {"process", d.integrating ? "integrating" : "self_regulating"},
                           {"evidence", evidence_sentence(d)}};
  if (d.verdict == Verdict::other_cause) result["cause"] = to_text(d.cause);
  if (d.oscillating) result["period_s"] = d.period_s;
  if (d.verdict == Verdict::not_enough_data) {
    result["process"] = nullptr;
  } else {
    for (std::size_t c = 0; c < diagnosis::kCauseCount; ++c) {
      const auto cause = static_cast<Cause>(c);
      result["probabilities"][cause == Cause::none ? "healthy" : to_text(cause)] =
          probability(d, cause);
    }
  }
  fmt::print("{}\n", result.dump(2));
}

void print_text(const Diagnosis& d, const DiagnoseOptions& options) {
  const double span = options.co_range[1] - options.co_range[0];
  switch (d.verdict) {
    case Verdict::valve_effect:
      fmt::print("valve effect: {}, {:.2g} % of the CO span ({:g} to {:g}), probability {:.0f} %\n",
                 to_text(d.cause), 100.0 * d.s / span, options.co_range[0], options.co_range[1],
                 100.0 * probability(d, d.cause));
      if (d.alternative != Cause::none) {
        fmt::print("or: {}, probability {:.0f} %\n", to_text(d.alternative),
                   100.0 * probability(d, d.alternative));
      }
      break;
    case Verdict::other_cause:
      fmt::print("no valve effect: {}, probability {:.0f} %\n", to_text(d.cause),
                 100.0 * probability(d, d.cause));
      break;
    case Verdict::healthy: fmt::print("healthy\n"); break;
    case Verdict::not_enough_data: fmt::print("not enough data\n"); break;
  }
  fmt::print("because: {}\n", evidence_sentence(d));
  if (d.verdict == Verdict::not_enough_data) return;
  if (d.oscillating) {
    fmt::print("oscillates with a period of {:.4g} s\n", d.period_s);
  } else {
    fmt::print("does not oscillate\n");
  }
  fmt::print("process: {}; {} samples used, {:.0f} periods\n",
             d.integrating ? "integrating" : "self-regulating", d.prepared.used, d.prepared.cycles);
}

int run_diagnose(const DiagnoseOptions& options) {
  if (!(options.co_range[1] > options.co_range[0])) {
    fmt::print(stderr, "--co-range: the upper end must be above the lower one\n");
    return kExitUsage;
  }
  try {
    const hal::record::Record r = hal::record::read_record(options.record);
    if (!r.has_co) {
      fmt::print(stderr, "{}: no column 'co': nothing can be said about a valve without it\n",
                 options.record);
      return kExitData;
    }
    const Diagnosis d = diagnosis::diagnose({.pv = r.pv,
                                             .co = r.co,
                                             .sp = r.sp,
                                             .sample_time_s = r.period_s,
                                             .co_low = options.co_range[0],
                                             .co_high = options.co_range[1]});
    options.json ? print_json(d, options) : print_text(d, options);
  } catch (const hal::record::RecordError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return e.kind() == hal::record::RecordError::Kind::io ? kExitIo : kExitData;
  }
  return kExitOk;
}

}  // namespace

void add_diagnose(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<DiagnoseOptions>();
  CLI::App* sub =
      app.add_subcommand("diagnose", "valve effect or other cause, from a record and no model");
  sub->add_option("record", options->record, "routine record, CSV: time, pv, co, and sp if known")
      ->required();
  sub->add_option("--co-range", options->co_range, "lower and upper end of CO, default 0 100")
      ->expected(2);
  sub->add_flag("--json", options->json, "print the result as JSON");
  sub->footer("Example: loopwarden diagnose data/routine/r22.csv --json");
  sub->callback([options, &exit_code] { exit_code = run_diagnose(*options); });
}

}  // namespace loopwarden::workbench
