// SPDX-License-Identifier: Apache-2.0
// loopwarden-study jacket: the tables of jacket_study.hpp, as text or JSON.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>
#include <vector>

#include "config/loop_model_writer.hpp"
#include "studies/jacket/jacket_study.hpp"
#include "workbench/command_line/progress.hpp"
#include "studies/program/studies.hpp"

namespace loopwarden::studies {
namespace {

using control::JacketForm;

struct JacketStudyOptions {
  std::size_t cases = 200;
  std::uint64_t seed = 1;
  unsigned threads = std::max(1U, std::thread::hardware_concurrency());
  bool json = false;
};

struct JacketStudy {
  std::vector<Plant1Row> plant1;
  std::vector<StickyStudy> sticky;  // steady load, wandering load
  std::vector<HealthyRow> healthy;
};

constexpr std::array kCompared{JacketForm::paper, JacketForm::bounded, JacketForm::dwell};

const char* name_of(ReadBackQuality quality) {
  switch (quality) {
    case ReadBackQuality::within_dead_zone: return "error within the dead zone";
    case ReadBackQuality::biased: return "bias of 1 to 3 % of span";
    case ReadBackQuality::noisy: break;
  }
  return "noise as large as the dead zone";
}

const char* name_of(Load load) { return load == Load::steady ? "steady" : "wandering"; }

std::string state_of(const TrialResult& result) {
  if (result.parked) return "parked";
  return result.settled.period_s > 0.0 ? "cycles" : "rests";
}

void print_plant1(const std::vector<Plant1Row>& rows) {
  fmt::print(
      "Plant 1 of the thesis with stiction: what the jacket does over Ks\n"
      "PI as tuned there, 0-10 V, 10 Hz, noise 0.01 V, 12 bit; mean over eight set points,\n"
      "45 min each, the last 30 min of it measured. PV and errors in L/min, S, J, CO and travel in "
      "V.\n\n"
      "{:<9} {:>4} {:>4}  {:<7} {:>5}  {:>7} {:>7} {:>7} {:>8} {:>8} {:>8} {:>7} {:>7}  {}\n",
      "law", "S", "J", "form", "Ks", "PV +-", "period", "CO", "mean", "mean", "RMS", "travel",
      "turns", "state");
  fmt::print("{:<9} {:>4} {:>4}  {:<7} {:>5}  {:>7} {:>7} {:>7} {:>8} {:>8} {:>8} {:>7} {:>7}\n",
             "", "", "", "", "1/s", "", "s", "swing", "error", "|error|", "error", "/h", "/h");
  for (const Plant1Row& row : rows) {
    const analysis::LoopMetrics& m = row.result.settled;
    const std::string gain = row.gain_per_s > 0.0 ? fmt::format("{:g}", row.gain_per_s) : "-";
    if (row.form == JacketForm::off) fmt::print("\n");
    fmt::print(
        "{:<9} {:>4.1f} {:>4.1f}  {:<7} {:>5}  {:>7.3f} {:>7.1f} {:>7.3f} {:>8.3f} {:>8.3f} "
        "{:>8.3f} "
        "{:>7.2f} {:>7.1f}  {}\n",
        row.law, row.s, row.j, config::to_text(row.form), gain, row.result.pv_swing / 2.0,
        m.period_s, row.result.co_swing, m.mean_error, m.mean_abs_error, m.rms_error,
        m.travel_per_hour, m.reversals_per_hour, state_of(row.result));
  }
  fmt::print(
      "\nThe paper's claim for Ks > 0: smaller amplitude, narrower stick band (CO swing), higher "
      "frequency.\nChanges of more than 5 % against the same loop without jacket:\n\n"
      "{:<8} {:>8} {:>7} {:>7} | {:>9} {:>9} {:>10} {:>9} | {:>9}\n",
      "form", "settings", "parked", "cycling", "amplitude", "CO swing", "frequency", "all three",
      "RMS falls");
  for (const JacketForm form : kCompared) {
    const ClaimCount c = count_claims(rows, form);
    fmt::print("{:<8} {:>8} {:>7} {:>7} | {:>9} {:>9} {:>10} {:>9} | {:>9}\n",
               config::to_text(form), c.settings, c.parked, c.cycling, c.smaller, c.narrower,
               c.faster, c.all_three, c.rms_falls);
  }
}

void print_sticky(const StickyStudy& study, const JacketStudyOptions& options) {
  fmt::print("\n\nRandom sticky loops, {} load: {} cases, seed {}\n", name_of(study.load),
             options.cases, options.seed);
  if (study.load == Load::steady) {
    fmt::print(
        "S 1-15 % of span, J 0.1-1 S, three friction laws, gain 0.5-2, dead time / lag 0.2-2,\n"
        "lambda or Ziegler-Nichols tuning, noise 0-0.2 %, six set points; the read-back is off by\n"
        "up to 0.2 % of span. RMS of SP - true PV after settling, as a factor of that without\n"
        "jacket; 'all' counts set-point moves and settling too. Mean error in % of the RMS "
        "without\n"
        "jacket. The best Ks of each case is chosen on another run of that case.\n");
  } else {
    fmt::print("The same loops with a load that wanders by 0.1 to 1.2 % of span within minutes.\n");
  }
  fmt::print("Without jacket {:.1f} % park, mean error {:.1f} % of the RMS.\n\n",
             100.0 * study.share_parked_off, 100.0 * study.mean_error_off);
  fmt::print(
      "{:<17} {:>5} {:>6} {:>6} {:>6} | {:>6} {:>6} {:>6} {:>6} | {:>6} {:>6} | {:>5} {:>6} {:>6} "
      "{:>6}\n",
      "", "Ks", "falls", ">5 %", "rises", "RMS", "", "", "", "all", "", "mean", "travel", "turns",
      "parked");
  fmt::print(
      "{:<17} {:>5} {:>6} {:>6} {:>6} | {:>6} {:>6} {:>6} {:>6} | {:>6} {:>6} | {:>5} {:>6} {:>6} "
      "{:>6}\n",
      "form", "med.", "%", "%", ">5 %", "10 %", "median", "90 %", "worst", "median", "90 %",
      "error", "", "", "%");
  for (const StickyRow& row : study.rows) {
    const std::string gain = row.gain_per_s > 0.0 ? fmt::format("{:g}", row.gain_per_s) : "-";
    fmt::print(
        "{:<17} {:>5} {:>6.1f} {:>6.1f} {:>6.1f} | {:>6.3f} {:>6.3f} {:>6.3f} {:>6.3f} | {:>6.3f} "
        "{:>6.3f} | {:>4.0f}% {:>6.2f} {:>6.2f} {:>6.1f}\n",
        row.name, gain, 100.0 * row.share_falls, 100.0 * row.share_falls_5,
        100.0 * row.share_rises_5, row.rms_factor.tenth, row.rms_factor.median,
        row.rms_factor.ninetieth, row.rms_factor.worst, row.whole_rms_factor.median,
        row.whole_rms_factor.ninetieth, 100.0 * row.mean_error, row.travel_factor,
        row.reversals_factor, 100.0 * row.share_parked);
  }
}

void print_healthy(const std::vector<HealthyRow>& rows, const JacketStudyOptions& options) {
  fmt::print(
      "\n\nRandom healthy loops: {} cases for each read-back, positioner lag 0-2 s, Ks = 1\n"
      "Rise of the settled RMS of SP - true PV in % of the PV span; 'all' as above.\n\n"
      "{:<33} {:<8} {:>12} {:>12} | {:>10} {:>10}\n",
      options.cases, "read-back", "form", "rises >0.02 %", "worst rise", "all median", "all worst");
  for (const HealthyRow& row : rows) {
    fmt::print("{:<33} {:<8} {:>11.1f} % {:>11.3f} % | {:>10.3f} {:>10.3f}\n", name_of(row.quality),
               config::to_text(row.form), 100.0 * row.share_rises, row.worst_rise_percent,
               row.whole_rms_factor.median, row.whole_rms_factor.worst);
  }
}

nlohmann::json json_of(const Spread& s) {
  return {{"tenth", s.tenth}, {"median", s.median}, {"ninetieth", s.ninetieth}, {"worst", s.worst}};
}

nlohmann::json json_of(const Plant1Row& row) {
  const analysis::LoopMetrics& m = row.result.settled;
  return {{"law", row.law},
          {"s", row.s},
          {"j", row.j},
          {"form", config::to_text(row.form)},
          {"ks", row.gain_per_s},
          {"amplitude", row.result.pv_swing / 2.0},
          {"period_s", m.period_s},
          {"co_swing", row.result.co_swing},
          {"mean_error", m.mean_error},
          {"mean_abs_error", m.mean_abs_error},
          {"rms_error", m.rms_error},
          {"travel_per_hour", m.travel_per_hour},
          {"reversals_per_hour", m.reversals_per_hour},
          {"state", state_of(row.result)}};
}

nlohmann::json json_of(JacketForm form, const ClaimCount& c) {
  return {{"form", config::to_text(form)},
          {"settings", c.settings},
          {"parked", c.parked},
          {"cycling", c.cycling},
          {"smaller", c.smaller},
          {"narrower", c.narrower},
          {"faster", c.faster},
          {"all_three", c.all_three},
          {"rms_falls", c.rms_falls}};
}

nlohmann::json json_of(const StickyRow& row) {
  return {{"name", row.name},
          {"ks", row.gain_per_s},
          {"share_falls", row.share_falls},
          {"share_falls_5_percent", row.share_falls_5},
          {"share_rises_5_percent", row.share_rises_5},
          {"rms_factor", json_of(row.rms_factor)},
          {"whole_rms_factor", json_of(row.whole_rms_factor)},
          {"mean_error", row.mean_error},
          {"travel_factor", row.travel_factor},
          {"reversals_factor", row.reversals_factor},
          {"share_parked", row.share_parked}};
}

nlohmann::json json_of(const StickyStudy& study) {
  nlohmann::json result = {{"load", name_of(study.load)},
                           {"mean_error_off", study.mean_error_off},
                           {"share_parked_off", study.share_parked_off},
                           {"rows", nlohmann::json::array()}};
  for (const StickyRow& row : study.rows) result["rows"].push_back(json_of(row));
  return result;
}

nlohmann::json json_of(const HealthyRow& row) {
  return {{"read_back", name_of(row.quality)},
          {"form", config::to_text(row.form)},
          {"share_rises", row.share_rises},
          {"worst_rise_percent", row.worst_rise_percent},
          {"whole_rms_factor", json_of(row.whole_rms_factor)}};
}

void print_json(const JacketStudy& study, const JacketStudyOptions& options) {
  nlohmann::json result = {{"cases", options.cases},
                           {"seed", options.seed},
                           {"plant1", nlohmann::json::array()},
                           {"claims", nlohmann::json::array()},
                           {"sticky", nlohmann::json::array()},
                           {"healthy", nlohmann::json::array()}};
  for (const Plant1Row& row : study.plant1) result["plant1"].push_back(json_of(row));
  for (const JacketForm form : kCompared) {
    result["claims"].push_back(json_of(form, count_claims(study.plant1, form)));
  }
  for (const StickyStudy& sticky : study.sticky) result["sticky"].push_back(json_of(sticky));
  for (const HealthyRow& row : study.healthy) result["healthy"].push_back(json_of(row));
  fmt::print("{}\n", result.dump(2));
}

template <class Study>
auto with_progress(const char* what, unsigned threads, Study&& study) {
  std::unique_ptr<workbench::Progress> line;
  return study(StudyWork{.threads = threads, .progress = [&](std::size_t done, std::size_t total) {
                           if (!line) line = std::make_unique<workbench::Progress>(what, total);
                           line->update(done);
                         }});
}

int run_jacket_study(const JacketStudyOptions& options) {
  JacketStudy study;
  study.plant1 = with_progress("plant 1", options.threads, [&](const StudyWork& work) {
    return study_plant1(options.seed, work);
  });
  for (const Load load : {Load::steady, Load::wandering}) {
    study.sticky.push_back(
        with_progress("sticky loops", options.threads, [&](const StudyWork& work) {
          return study_sticky_loops(options.cases, options.seed, load, work);
        }));
  }
  study.healthy = with_progress("healthy loops", options.threads, [&](const StudyWork& work) {
    return study_healthy_loops(options.cases, options.seed, work);
  });
  if (options.json) {
    print_json(study, options);
    return kExitOk;
  }
  print_plant1(study.plant1);
  for (const StickyStudy& sticky : study.sticky) print_sticky(sticky, options);
  print_healthy(study.healthy, options);
  return kExitOk;
}

}  // namespace

void add_jacket(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<JacketStudyOptions>();
  CLI::App* sub = app.add_subcommand(
      "jacket", "what the forms of the stickband jacket do to sticky and healthy loops");
  sub->add_option("--cases", options->cases, "random loops, sticky and healthy")
      ->capture_default_str()
      ->check(CLI::Range(std::size_t{1}, std::size_t{100000}));
  sub->add_option("--seed", options->seed, "of everything random")->capture_default_str();
  sub->add_option("--threads", options->threads, "the result does not depend on it")
      ->check(CLI::Range(1U, 1024U));
  sub->add_flag("--json", options->json, "print the result as JSON");
  sub->footer("Example: loopwarden-study jacket --cases 200 --seed 1");
  sub->callback([options, &exit_code] { exit_code = run_jacket_study(*options); });
}

}  // namespace loopwarden::studies
