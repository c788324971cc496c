// SPDX-License-Identifier: Apache-2.0
#include "workbench/commands/replay_evidence.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>

#include "config/specialists/specialist_folder.hpp"
#include "record/evidence/evidence_file.hpp"
#include "model/monitor/specialist_judge.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {
namespace {

using evidence::Evidence;
using monitor::WindowJudgement;
using monitor::WindowMeasures;
using nlohmann::json;

// Another compiler or machine may round the last digits otherwise; the same one gives the same bits.
constexpr double kTolerance = 1e-6;  // relative

bool same(double a, double b) {
  return std::abs(a - b) <= kTolerance * std::max({1.0, std::abs(a), std::abs(b)});
}

bool same(const WindowJudgement& a, const WindowJudgement& b) {
  const auto close = [](double x, double y) { return same(x, y); };
  return a.result == b.result && a.fault == b.fault &&
         same(a.severity_percent, b.severity_percent) &&
         std::equal(a.probability.begin(), a.probability.end(), b.probability.begin(), close) &&
         std::equal(a.errors.begin(), a.errors.end(), b.errors.begin(), close);
}

std::string name_of(const WindowJudgement& j) {
  return j.result == WindowJudgement::Result::fault ? monitor::to_text(j.fault)
                                                    : monitor::to_text(j.result);
}

// NaN where the verdict has no size.
double severity_of(const WindowJudgement& j) {
  const bool known = j.result != WindowJudgement::Result::fault || monitor::has_size(j.fault);
  return known ? j.severity_percent : std::nan("");
}

class Table {
 public:
  void row(const char* what, const std::string& then, const std::string& now) const {
    fmt::print("{:<34} {:>20} {:>20}\n", what, then, now);
  }
  void row(const std::string& what, double then, double now) const {
    const auto text = [](double v) { return std::isnan(v) ? "-" : fmt::format("{:.6g}", v); };
    row(what.c_str(), text(then), text(now));
  }
};

void print_text(const Evidence& e, const WindowJudgement& now, const WindowMeasures& measures) {
  fmt::print("{} of {}, raised {:%Y-%m-%d %H:%M:%S} UTC by loopwardend {}\n",
             monitor::to_text(e.alarm), e.loop,
             fmt::gmtime(static_cast<std::time_t>(e.raised_ms / 1000)), e.version);
  fmt::print(
      "{} samples each {:g} s, {} cycles of them stood in for; configuration {:08x} ({}), "
      "specialists {:08x} ({})\n\n",
      e.pv.size(), e.sample_time_s, e.measures.bridged_cycles, e.config_hash, e.loop_file,
      e.specialists_hash, e.specialists_folder);
  const Table table;
  table.row("", "then", "now");
  table.row("verdict on the window", name_of(e.judgement), name_of(now));
  table.row("severity, % of CO span", severity_of(e.judgement), severity_of(now));
  for (const monitor::AlarmKind kind : monitor::kAlarmKinds) {
    const std::size_t k = monitor::index_of(kind);
    table.row(fmt::format("probability of {}", to_text(kind)), e.judgement.probability[k],
              now.probability[k]);
  }
  for (std::size_t c = 0; c < specialist::kConditions; ++c) {
    table.row(fmt::format("error of {}, (% CO span)^2",
                          specialist::to_text(static_cast<specialist::Condition>(c))),
              e.judgement.errors[c], now.errors[c]);
  }
  table.row("oscillation index", e.measures.oscillation_index, measures.oscillation_index);
  table.row("period, s", e.measures.period_s, measures.period_s);
  table.row("variability, % of PV span", e.measures.variability_percent,
            measures.variability_percent);
  table.row("stick, % of CO span", e.measures.stick_percent, measures.stick_percent);
}

}  // namespace

int replay_evidence(const std::filesystem::path& folder, bool as_json) {
  Evidence evidence;
  try {
    evidence = evidence::read_evidence(folder);
  } catch (const evidence::EvidenceError& e) {
    fmt::print(stderr, "{}\n", e.what());
    return kExitData;
  }
  const auto loaded = config::read_specialists(evidence::specialists_of(folder));
  fmt::print(stderr, "{}", config::to_text(loaded.diagnostics));
  if (!loaded || !loaded->team) return kExitConfiguration;
  monitor::SpecialistJudge judge(*loaded->team);
  const WindowJudgement now = judge.judge(evidence.window());
  const WindowMeasures measures = monitor::measure(evidence.window());
  const bool agree = same(evidence.judgement, now);
  if (as_json) {
    fmt::print("{}\n", json{{"loop", evidence.loop},
                            {"alarm", to_text(evidence.alarm)},
                            {"verdict_then", name_of(evidence.judgement)},
                            {"verdict_now", name_of(now)},
                            {"severity_percent", finite_or_null(severity_of(now))},
                            {"same", agree}}
                           .dump(2));
  } else {
    print_text(evidence, now, measures);
    fmt::print("\n{}\n", agree ? "The same verdict." : "NOT the same verdict.");
  }
  return agree ? kExitOk : kExitData;
}

}  // namespace loopwarden::workbench
