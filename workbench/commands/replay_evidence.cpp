// SPDX-License-Identifier: Apache-2.0
#include "workbench/command_line/frame.hpp"
#include "model/watch/limits.hpp"
#include "workbench/commands/replay_evidence.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <string>

#include "config/specialists/specialist_folder.hpp"
#include "model/watch/specialist_judge.hpp"
#include "model/watch/controller_watch.hpp"
#include "model/watch/twin_watch.hpp"
#include "config/evidence_file/evidence_file.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/files/model_file.hpp"
#include "workbench/text/json_number.hpp"

namespace loopwarden::workbench {
namespace {

using alarm::WindowJudgement;
using alarm::WindowMeasures;
using evidence::Evidence;
using Judgement = watch::RoutineWatch::Judgement;
using nlohmann::json;

// Another compiler or machine may round the last digits differently. The same one gives identical
// bits.
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
  return j.result == WindowJudgement::Result::fault ? alarm::to_text(j.fault)
                                                    : alarm::to_text(j.result);
}

// NaN if the verdict has no size.
double severity_of(const WindowJudgement& j) {
  const bool known = j.result != WindowJudgement::Result::fault || alarm::has_size(j.fault);
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

void print_alarm(const Evidence& e) {
  fmt::print("{} of {}, raised {:%Y-%m-%d %H:%M:%S} UTC by loopwardend {}\n",
             alarm::to_text(e.alarm), e.loop,
             fmt::gmtime(static_cast<std::time_t>(e.raised_ms / 1000)), e.version);
}

void print_text(const Evidence& e, const WindowJudgement& now, const WindowMeasures& measures) {
  print_alarm(e);
  fmt::print(
      "{} samples each {:g} s, {} cycles of them replaced; configuration {:08x} ({}), "
      "specialists {:08x} ({})\n\n",
      e.pv.size(), e.sample_time_s, e.measures.bridged_cycles, e.config_hash, e.loop_file,
      e.specialists_hash, e.specialists_folder);
  const Table table;
  table.row("", "then", "now");
  table.row("verdict on the window", name_of(e.judgement), name_of(now));
  table.row("severity, % of CO span", severity_of(e.judgement), severity_of(now));
  for (const alarm::AlarmKind kind : alarm::kWindowAlarms) {
    const std::size_t k = alarm::index_of(kind);
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

void print_routine(const Evidence& e, const Judgement& now) {
  const Judgement& then = *e.routine;
  print_alarm(e);
  fmt::print(
      "routine evidence: {} samples each {:g} s, the last {:.0f} min before it; configuration "
      "{:08x} ({})\n\n",
      e.pv.size(), e.sample_time_s, then.window_s / 60.0, e.config_hash, e.loop_file);
  const Table table;
  table.row("", "then", "now");
  table.row("verdict on these samples", to_text(then.verdict), to_text(now.verdict));
  table.row("grade", to_text(then.grade), to_text(now.grade));
  table.row("probability of a valve effect", then.probability, now.probability);
  table.row("log odds of a band, nats", then.evidence.log_odds, now.evidence.log_odds);
  table.row("band, % of CO's movement", 100.0 * then.evidence.share, 100.0 * now.evidence.share);
  table.row("band explains of PV, %", 100.0 * then.evidence.explained,
            100.0 * now.evidence.explained);
  table.row("PV rests, % of CO's moves", 100.0 * then.evidence.standing,
            100.0 * now.evidence.standing);
  table.row("CO turns by", to_text(then.evidence.reversals.by()),
            to_text(now.evidence.reversals.by()));
  table.row("severity, % of CO span", then.severity_percent, now.severity_percent);
  fmt::print(
      "\nevidence in nats: {:.2f} from earlier windows (their samples are not stored here), "
      "{:+.2f} from the specialists, {:.2f} in total with this window; alarm threshold {:g}\n",
      then.sum_before, then.from_specialists, then.sum, watch::WatchLimits::kRaise);
}

bool same(const Judgement& a, const Judgement& b) {
  return a.verdict == b.verdict && a.grade == b.grade && same(a.probability, b.probability) &&
         same(a.evidence.log_odds, b.evidence.log_odds) &&
         same(a.evidence.share, b.evidence.share) &&
         same(a.evidence.explained, b.evidence.explained) &&
         same(a.evidence.standing, b.evidence.standing) &&
         a.evidence.reversals.by() == b.evidence.reversals.by() &&
         (a.verdict != diagnosis::DiagnosisVerdict::valve_effect ||
          same(a.severity_percent, b.severity_percent));
}

const char* kind_of(const Evidence& e) {
  if (e.routine) return "routine";
  return e.by_twin ? "twin" : "window";
}

void print_json(const Evidence& e, const std::string& then, const std::string& now,
                double severity_percent, bool agree) {
  show_json(json{{"loop", e.loop},
                 {"alarm", to_text(e.alarm)},
                 {"kind", kind_of(e)},
                 {"verdict_then", then},
                 {"verdict_now", now},
                 {"severity_percent", finite_or_null(severity_percent)},
                 {"same", agree}});
}

int conclude(bool agree, bool as_json) {
  if (!as_json) fmt::print("\n{}\n", agree ? "The same verdict." : "NOT the same verdict.");
  return agree ? kExitOk : kExitData;
}

int replay_routine(const Evidence& e, bool as_json) {
  const Judgement now = watch::judge_routine({.period_s = e.sample_time_s,
                                              .pv = e.pv,
                                              .sp = e.sp,
                                              .co = e.co,
                                              .co_low = e.co_low,
                                              .co_high = e.co_high});
  const bool agree = same(*e.routine, now);
  as_json ? print_json(e, to_text(e.routine->verdict), to_text(now.verdict), now.severity_percent,
                       agree)
          : print_routine(e, now);
  return conclude(agree, as_json);
}

// Runs the twin's watch over the same minutes. It began earlier in the daemon, so its final state
// may differ a little.
int replay_twin(const Evidence& e, const std::filesystem::path& folder, bool as_json) {
  const plant::LoopModel twin = load_model((folder / "twin.yaml").string());
  watch::TwinWatch watch(twin);
  // The controller of a loop that ran here was not watched. Its gains, jacket or compensator may
  // have moved CO.
  const bool controller_watched = std::isfinite(e.by_twin->controller);
  watch::ControllerWatch controller(twin);
  for (std::size_t k = 0; k < e.pv.size(); ++k) {
    watch.add(e.pv[k], e.co[k]);
    controller.add(e.sp[k], e.pv[k], e.co[k]);
  }
  const bool on = watch.on() || (controller_watched && controller.on());
  const char* now = on ? to_text(e.alarm) : "no gap";
  if (as_json) {
    print_json(e, to_text(e.alarm), now, std::nan(""), on);
  } else {
    print_alarm(e);
    fmt::print("the twin over the {:.0f} min before it; configuration {:08x} ({})\n\n",
               static_cast<double>(e.pv.size()) * e.sample_time_s / 60.0, e.config_hash,
               e.loop_file);
    const Table table;
    table.row("", "then", "now");
    table.row("verdict", to_text(e.alarm), now);
    table.row("change of the loop, over its limit", e.by_twin->change,
              watch.largest() / watch.limit());
    table.row("controller, over its limit", e.by_twin->controller,
              controller_watched ? controller.score() : std::nan(""));
  }
  return conclude(on, as_json);
}

}  // namespace

int replay_evidence(const std::filesystem::path& folder, bool as_json) {
  Evidence evidence;
  try {
    evidence = evidence::read_evidence(folder);
  } catch (const evidence::EvidenceError& e) {
    fail(kExitData, "{}", e.what());
  }
  if (evidence.routine) return replay_routine(evidence, as_json);
  if (evidence.by_twin) return replay_twin(evidence, folder, as_json);
  const auto specialists = usable(config::read_specialists(evidence::specialists_of(folder)));
  if (!specialists.team) return kExitConfiguration;
  watch::SpecialistJudge judge(*specialists.team);
  const WindowJudgement now = judge.judge(evidence.window());
  const WindowMeasures measures = alarm::measure(evidence.window());
  const bool agree = same(evidence.judgement, now);
  as_json ? print_json(evidence, name_of(evidence.judgement), name_of(now), severity_of(now), agree)
          : print_text(evidence, now, measures);
  return conclude(agree, as_json);
}

}  // namespace loopwarden::workbench
