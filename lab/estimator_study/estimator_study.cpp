// SPDX-License-Identifier: Apache-2.0
// Runs model/gap and model/estimator on the same cases and prints both next to each other.
#include <fmt/format.h>
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "config/loop_model_reader.hpp"
#include "lab/gap_study/gap_runner.hpp"
#include "lab/gap_study/score.hpp"
#include "lab/program/share.hpp"
#include "model/estimator/estimate.hpp"
#include "model/gap/check.hpp"
#include "model/gap/controller.hpp"
#include "model/gap/say.hpp"
#include "model/gap/workflow.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::studies {
namespace {

using gap_study::Answer;
using gap_study::CaseFiles;
using nlohmann::json;

struct Arguments {
  std::vector<std::string> cases;
  std::string engine = "new";
  std::string answers;  // file of earlier answers; empty: none
  std::vector<std::string> without;
  std::string only;
  bool verbose = false;
  bool list = false;
  bool without_truth = false;
};

void one_thread(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

double processor_s() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto s = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return s(used.ru_utime) + s(used.ru_stime);
}

gap::Record read_record(const std::filesystem::path& path) {
  record::Record file = record::read_record(path);
  return {file.period_s, std::move(file.pv), std::move(file.sp), std::move(file.co), {}};
}

plant::LoopModel read_model(const std::filesystem::path& path) {
  config::Loaded<plant::LoopModel> model = config::read_model_file(path);
  if (!model) throw std::runtime_error(config::to_text(model.diagnostics));
  return *model;
}

// An answer as a file keeps it.
json answer_of_old(const gap::Record& record, const plant::LoopModel& model,
                   const Arguments& arguments) {
  gap::Options options;
  options.search.without = arguments.without;
  const gap::Result r = gap::find_gap(record, model, options, one_thread, [](double) {});
  json out{{"verdict", gap::to_text(r.outcome)},
           {"effects", json::array()},
           {"gap",
            {{"before", {{"holdout_rmse", r.before.holdout_rmse}}},
             {"after", {{"holdout_rmse", r.after.holdout_rmse}}}}}};
  for (const gap::FoundEffect& e : r.effects) {
    out["effects"].push_back({{"name", e.spec.name},
                              {"confidence", e.confidence},
                              {"parameters", e.spec.parameters},
                              {"intervals", e.interval}});
  }
  return out;
}

json answer_of_new(const gap::Record& record, const plant::LoopModel& model,
                   const Arguments& arguments) {
  const gap::CheckedRecord checked = gap::check(record, model);
  if (!checked.quality.usable) {
    return {{"verdict", "unexplained"},
            {"effects", json::array()},
            {"gap", {{"before", json::object()}, {"after", json::object()}}}};
  }
  const estimator::Observed observed{checked.record.period_s, checked.co, checked.pv,
                                     checked.measured};
  plant::LoopModel given = checked.model;
  given.transmitter.resolution = model.transmitter.resolution;
  const estimator::Estimate e =
      estimator::estimate(observed, given, {.without = arguments.without}, one_thread);
  json out{{"verdict", estimator::to_text(e.verdict)},
           {"effects", json::array()},
           {"gap",
            {{"before", {{"holdout_rmse", e.before.holdout}}},
             {"after", {{"holdout_rmse", e.after.holdout}}}}},
           {"floor", e.floor},
           {"evaluations", e.evaluations}};
  for (const estimator::Found& f : e.effects) {
    json intervals = json::object();
    for (const auto& [name, i] : f.intervals) intervals[name] = i.within;
    out["effects"].push_back({{"name", f.spec.name},
                              {"confidence", f.confidence},
                              {"parameters", f.spec.parameters},
                              {"intervals", intervals},
                              {"description", f.description}});
  }
  // The parts of model/gap that are no fit of the plant.
  const auto add = [&](const effects::EffectSpec& spec, double confidence) {
    if (std::find(arguments.without.begin(), arguments.without.end(), spec.name) !=
        arguments.without.end()) {
      return;
    }
    out["effects"].push_back({{"name", spec.name},
                              {"confidence", confidence},
                              {"parameters", spec.parameters},
                              {"intervals", json::object()}});
    out["verdict"] = "missing_effect";
  };
  for (const gap::FoundEffect& found : gap::describe_reading(checked.reading, model)) {
    add(found.spec, found.confidence);
  }
  if (!checked.closed_loop) {
    const gap::ControllerFinding c = gap::compare_controller(checked.record, checked.model);
    // Other settings explain nothing of a gap of the plant, unless they give CO exactly.
    const bool counts = c.exact || e.verdict != estimator::Verdict::unexplained;
    if (c.mismatch && counts) add({"controller_mismatch", {{"kp", c.kp}, {"ki", c.ki}}}, 0.97);
  }
  if (arguments.verbose) {
    std::size_t printed = 0;
    for (const estimator::Ranked& r : e.ranked) {
      if (++printed > 12 && r.title != "none") continue;
      fmt::print(
          "   {:<40} score {:9.1f} ll {:9.1f} w {:.3f} left {:.4g} {:.4g} q {:.2g} c {:.2g}{}\n",
          r.title, r.score, r.log_likelihood, r.weight, r.left.training, r.left.holdout,
          r.error.disturbance, r.error.law, r.parameters);
    }
    fmt::print("   chosen {}: left {:.4g} {:.4g} with slips {:.4g}\n", e.chosen,
               e.chosen_left.training, e.chosen_left.holdout, e.with_slips);
    fmt::print("   flexible {}: {:.1f} nats, left {:.4g} {:.4g}\n", e.flexible, e.flexible_lead,
               e.with_flexible.training, e.with_flexible.holdout);
    fmt::print(
        "   noise {:.4g} floor {:.4g} law {:.4g} before {:.4g} {:.4g} after {:.4g} {:.4g} evals "
        "{}\n",
        e.noise_rms, e.floor, e.law_error, e.before.training, e.before.holdout, e.after.training,
        e.after.holdout, e.evaluations);
  }
  return out;
}

struct Coverage {
  std::map<std::string, std::pair<int, int>> of;  // parameter: inside, all
};

void count_coverage(const gap_study::Truth& truth, const json& answer, Coverage& coverage) {
  for (const json& effect : answer["effects"]) {
    for (const auto& [name, range] : effect["intervals"].items()) {
      const auto value = truth.parameters.find(name);
      if (value == truth.parameters.end()) continue;
      auto& [inside, all] = coverage.of[name];
      ++all;
      if (value->second >= range[0].get<double>() && value->second <= range[1].get<double>()) {
        ++inside;
      }
    }
  }
}

std::string names_of(const json& answer) {
  std::string text;
  for (const json& e : answer["effects"]) {
    text += fmt::format(
        "{}{} {:.2f}", text.empty() ? "" : " + ",
        e["name"].get<std::string>() + (e.value("description", "").empty()
                                            ? ""
                                            : " (" + e["description"].get<std::string>() + ")"),
        e["confidence"].get<double>());
  }
  return answer["verdict"].get<std::string>() + (text.empty() ? "" : ": " + text);
}

int run(const Arguments& arguments) {
  json kept = json::object();
  if (!arguments.answers.empty()) {
    if (std::ifstream in(arguments.answers); in) kept = json::parse(in);
  }
  std::vector<gap_study::ScoredCase> scored;
  Coverage coverage;
  int outside_wrong = 0;
  int outside_sure = 0;
  int outside_learned = 0;
  int outside_named = 0;
  for (const std::string& folder : arguments.cases) {
    for (const CaseFiles& files : gap_study::find_cases(folder)) {
      if (!arguments.only.empty() &&
          (files.truth.effect + " " + files.truth.id).find(arguments.only) == std::string::npos) {
        continue;
      }
      const std::string key = arguments.engine + " " + files.folder.string();
      json answer;
      if (kept.contains(key)) {
        answer = kept[key];
      } else {
        Arguments own = arguments;
        if (arguments.without_truth) own.without = files.truth.accept;
        const gap::Record record = read_record(files.folder / "record.csv");
        const plant::LoopModel model = read_model(files.folder / "model.yaml");
        const double began_s = processor_s();
        answer = arguments.engine == "old" ? answer_of_old(record, model, own)
                                           : answer_of_new(record, model, own);
        answer["seconds"] = processor_s() - began_s;
        kept[key] = answer;
        if (!arguments.answers.empty()) std::ofstream(arguments.answers) << kept.dump(1);
      }
      Answer parsed = gap_study::parse_answer(answer.dump());
      parsed.seconds = answer["seconds"].get<double>();
      gap_study::ScoredCase one{files.truth, parsed, gap_study::score_case(files.truth, parsed)};
      count_coverage(files.truth, answer, coverage);
      const bool learned = !parsed.effects.empty() && parsed.effects[0].name == "learned";
      if (learned && one.score.kind == gap_study::Kind::kOutside) {
        one.score.right = true;
        ++outside_learned;
      } else if (one.score.kind == gap_study::Kind::kOutside && one.score.right &&
                 parsed.verdict == "missing_effect") {
        ++outside_named;
      }
      if (one.score.kind == gap_study::Kind::kOutside && !one.score.right && one.score.counts &&
          parsed.verdict == "missing_effect") {
        ++outside_wrong;
        for (const auto& [confidence, right] : one.score.names) {
          if (!right && confidence >= 0.9) {
            ++outside_sure;
            break;
          }
        }
      }
      if (arguments.list) {
        std::string truth_parameters;
        for (const auto& [name, value] : files.truth.parameters) {
          truth_parameters += fmt::format(" {} {:.4g}", name, value);
        }
        std::string found;
        for (const json& e : answer["effects"]) {
          for (const auto& [name, range] : e["intervals"].items()) {
            if (!files.truth.parameters.contains(name)) continue;
            found +=
                fmt::format(" {} {:.4g} [{:.4g} {:.4g}]", name, e["parameters"][name].get<double>(),
                            range[0].get<double>(), range[1].get<double>());
          }
        }
        const auto hold = [&](const char* at) {
          const json& gap = answer["gap"][at];
          return gap.contains("holdout_rmse") && gap["holdout_rmse"].is_number()
                     ? gap["holdout_rmse"].get<double>()
                     : std::nan("");
        };
        fmt::print(
            "{} {:<6} {:<34} {:<60} closed {:.3f} hold {:.3f} {:.3f} floor {:.3f} {:.1f} s "
            "|{}|{}\n",
            one.score.right ? " " : "X", files.truth.id, files.truth.effect, names_of(answer),
            one.score.closed.value_or(std::nan("")), hold("before"), hold("after"),
            files.truth.floor_rmse, answer["seconds"].get<double>(), truth_parameters, found);
        std::fflush(stdout);
      }
      scored.push_back(std::move(one));
    }
  }
  if (scored.empty()) return 0;
  const gap_study::Summary s = gap_study::summarise(scored);
  fmt::print("engine {}: {} cases\n", arguments.engine, s.cases);
  fmt::print("  singles named, no second name   {} of {}\n", s.single_right.hits,
             s.single_right.of);
  fmt::print("  pairs, both and no third        {} of {}\n", s.pair_right.hits, s.pair_right.of);
  fmt::print("  none hidden, named              {} of {}\n", s.none_named.hits, s.none_named.of);
  fmt::print(
      "  outside: right or unexplained   {} of {} (named {}, learned {}); wrong {}, at 0.9 {}\n",
      s.outside_unexplained.hits, s.outside_unexplained.of, outside_named, outside_learned,
      outside_wrong, outside_sure);
  fmt::print("  names at 0.9 right              {} of {}\n", s.confident_right.hits,
             s.confident_right.of);
  if (!s.closed.empty()) {
    fmt::print("  closed, median / worst tenth    {:.3f} / {:.3f}\n",
               gap_study::quantile(s.closed, 0.5), gap_study::quantile(s.closed, 0.1));
  }
  int inside = 0;
  int all = 0;
  std::string by;
  for (const auto& [name, share] : coverage.of) {
    inside += share.first;
    all += share.second;
    by += fmt::format(" {} {}/{}", name, share.first, share.second);
  }
  fmt::print("  95 % intervals with the truth   {} of {}:{}\n", inside, all, by);
  fmt::print("  processor s, median / worst     {:.1f} / {:.1f}\n",
             gap_study::quantile(s.seconds, 0.5), gap_study::quantile(s.seconds, 1.0));
  return 0;
}

}  // namespace
}  // namespace loopwarden::studies

int main(int argc, char** argv) {
  using namespace loopwarden::studies;
  CLI::App app("Runs both engines on hidden cases");
  Arguments arguments;
  app.add_option("--cases", arguments.cases, "folders with truth.json")->required();
  app.add_option("--engine", arguments.engine, "old or new")->check(CLI::IsMember({"old", "new"}));
  app.add_option("--answers", arguments.answers, "file that keeps answers");
  app.add_option("--without", arguments.without, "names that are not given");
  app.add_option("--only", arguments.only, "cases with this text in effect or id");
  app.add_flag("--verbose", arguments.verbose, "print the competition");
  app.add_flag("--list", arguments.list, "one line per case");
  app.add_flag("--without-truth", arguments.without_truth, "the catalogue without the right names");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(arguments);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
