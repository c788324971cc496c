// SPDX-License-Identifier: Apache-2.0
// Runs model/estimator, and `gap` of other programs, on the same cases and prints one table.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
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
#include "record/record_csv.hpp"

namespace loopwarden::lab {
namespace {

using gap_study::Answer;
using gap_study::CaseFiles;
using nlohmann::json;

struct Arguments {
  std::vector<std::string> cases;
  std::vector<std::string> programs;
  std::string answers;  // file of earlier answers; empty: none
  std::vector<std::string> without;
  std::string only;
  bool verbose = false;
  bool list = false;
  bool taken_out = false;
  bool only_taken_out = false;
};

constexpr const char* kEstimator = "estimator";

void one_thread(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

numeric::LoopRecord read_record(const std::filesystem::path& path) {
  return record::read_record(path);
}

plant::LoopModel read_model(const std::filesystem::path& path) {
  config::Loaded<plant::LoopModel> model = config::read_model_file(path);
  if (!model) throw std::runtime_error(config::to_text(model.diagnostics));
  return *model;
}

// The answer of `PROGRAM gap` as its gap.json has it.
json answer_of_program(const CaseFiles& files, const std::string& path,
                       const Arguments& arguments) {
  const std::filesystem::path out =
      std::filesystem::temp_directory_path() / fmt::format("estimator-study-{}", getpid());
  std::vector<std::string> options;
  for (const std::string& name : arguments.without) {
    options.emplace_back("--without");
    options.push_back(name);
  }
  const gap_study::GapProgram program{.path = path, .time_limit_s = 3600.0, .options = options};
  const Answer answer = gap_study::run_gap(program, files.folder, out);
  if (!answer.failure.empty()) throw std::runtime_error(answer.failure);
  std::ifstream in(out / "gap.json");
  json raw = json::parse(in);
  std::filesystem::remove_all(out);
  raw["seconds"] = answer.seconds.value_or(0.0);
  return raw;
}

json answer_of_estimator(const numeric::LoopRecord& record, const plant::LoopModel& model,
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
                              {"interval", intervals},
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
                              {"interval", json::object()}});
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

// One case with the answer of one engine.
struct Result {
  gap_study::ScoredCase scored;
  json answer;
  bool taken_out = false;  // the right names were no candidates

  bool outside() const { return taken_out || scored.score.kind == gap_study::Kind::kOutside; }
  bool learned() const {
    const auto& effects = scored.answer.effects;
    return !effects.empty() && effects[0].name == "learned";
  }
  bool names() const { return scored.answer.verdict == "missing_effect"; }
  // Outside the catalogue: a name that is not the truth.
  bool wrong() const { return names() && !learned() && !scored.score.right; }
  bool sure() const {
    const auto& names = scored.score.names;
    return std::any_of(names.begin(), names.end(),
                       [](const auto& n) { return !n.second && n.first >= 0.9; });
  }
};

std::string names_of(const json& answer) {
  std::string text;
  for (const json& e : answer["effects"]) {
    const std::string description = e.value("description", "");
    text += fmt::format("{}{}{} {:.2f}", text.empty() ? "" : " + ", e["name"].get<std::string>(),
                        description.empty() ? "" : " (" + description + ")",
                        e["confidence"].get<double>());
  }
  return answer["verdict"].get<std::string>() + (text.empty() ? "" : ": " + text);
}

void print_case(const Result& result, const CaseFiles& files) {
  std::string truth;
  for (const auto& [name, value] : files.truth.parameters) {
    truth += fmt::format(" {} {:.4g}", name, value);
  }
  std::string found;
  for (const json& e : result.answer["effects"]) {
    if (!e.contains("interval")) continue;
    for (const auto& [name, range] : e["interval"].items()) {
      if (!files.truth.parameters.contains(name)) continue;
      found += fmt::format(" {} {:.4g} [{:.4g} {:.4g}]", name, e["parameters"][name].get<double>(),
                           range[0].get<double>(), range[1].get<double>());
    }
  }
  const Answer& answer = result.scored.answer;
  const bool right = result.taken_out ? !result.wrong() : result.scored.score.right;
  fmt::print(
      "{} {:<7} {:<28} {:<58} closed {:.3f} hold {:.3f} {:.3f} floor {:.3f} {:.1f} s |{}|{}\n",
      right || (result.outside() && result.learned()) ? " " : "X", files.truth.id,
      files.truth.effect, names_of(result.answer),
      result.scored.score.closed.value_or(std::nan("")), answer.before.value_or(std::nan("")),
      answer.after.value_or(std::nan("")), files.truth.floor_rmse, answer.seconds.value_or(0.0),
      truth, found);
  std::fflush(stdout);
}

void print_coverage(const std::vector<Result>& results) {
  std::map<std::string, Share> of;
  Share all;
  for (const Result& result : results) {
    if (result.outside()) continue;
    const auto& truth = result.scored.truth.parameters;
    for (const json& effect : result.answer["effects"]) {
      if (!effect.contains("interval")) continue;
      for (const auto& [name, range] : effect["interval"].items()) {
        const auto value = truth.find(name);
        if (value == truth.end()) continue;
        const bool inside =
            value->second >= range[0].get<double>() && value->second <= range[1].get<double>();
        of[name].count(inside);
        all.count(inside);
      }
    }
  }
  std::string by;
  for (const auto& [name, share] : of) by += fmt::format(" {} {}/{}", name, share.hits, share.of);
  fmt::print("  95 % intervals with the truth   {} of {}:{}\n", all.hits, all.of, by);
}

// Stated confidence against how often such names are right, with truths outside the catalogue at
// their prior.
void print_calibration(const std::vector<Result>& results) {
  constexpr double kOutside = 0.2;  // probability of a truth without a name
  constexpr std::array<double, 6> kBins{0.0, 0.5, 0.7, 0.85, 0.95, 1.01};
  double inside = 0.0;
  double outside = 0.0;
  for (const Result& result : results) {
    if (result.scored.score.kind != gap_study::Kind::kNone) {
      (result.outside() ? outside : inside) += 1.0;
    }
  }
  if (inside == 0.0 || outside == 0.0) return;
  fmt::print("  confidence, stated / right      ");
  for (std::size_t i = 0; i + 1 < kBins.size(); ++i) {
    double stated = 0.0;
    double right = 0.0;
    double sum = 0.0;
    for (const Result& result : results) {
      if (result.learned()) continue;
      const double weight = result.outside() ? kOutside / outside : (1.0 - kOutside) / inside;
      for (const auto& [confidence, is_right] : result.scored.score.names) {
        if (confidence < kBins[i] || confidence >= kBins[i + 1]) continue;
        sum += weight;
        stated += weight * confidence;
        if (is_right) right += weight;
      }
    }
    if (sum > 0.0) fmt::print(" {:.2f} / {:.2f}", stated / sum, right / sum);
  }
  fmt::print("\n");
}

void print_table(const std::string& engine, const std::vector<Result>& results) {
  std::vector<gap_study::ScoredCase> scored;
  Share taken_wrong, taken_sure;
  std::size_t named = 0, learned = 0, wrong = 0, sure = 0;
  for (const Result& result : results) {
    if (result.taken_out) {
      taken_wrong.count(result.wrong());
      taken_sure.count(result.wrong() && result.sure());
      continue;
    }
    scored.push_back(result.scored);
    if (!result.outside()) continue;
    if (result.learned()) {
      scored.back().score.right = true;
      ++learned;
    } else if (result.names() && result.scored.score.right) {
      ++named;
    } else if (result.names() && result.scored.score.counts) {
      ++wrong;
      if (result.sure()) ++sure;
    }
  }
  const gap_study::Summary s = gap_study::summarise(scored);
  const auto line = [](const char* what, const Share& share) {
    if (share.of > 0) fmt::print("  {:<31} {} of {}\n", what, share.hits, share.of);
  };
  fmt::print("engine {}: {} cases\n", engine, results.size());
  line("singles named, no second name", s.single_right);
  line("pairs, both and no third", s.pair_right);
  line("no effect hidden, a name given", s.none_named);
  line("outside: right or unexplained", s.outside_unexplained);
  if (s.outside_unexplained.of > 0) {
    fmt::print("    named {}, learned {}, wrong {}, wrong at 0.9 {}\n", named, learned, wrong,
               sure);
  }
  line("name taken out: wrong", taken_wrong);
  line("name taken out: wrong at 0.9", taken_sure);
  line("names at 0.9 right", s.confident_right);
  if (!s.closed.empty()) {
    fmt::print("  closed, median / worst tenth    {:.3f} / {:.3f}\n",
               gap_study::quantile(s.closed, 0.5), gap_study::quantile(s.closed, 0.1));
  }
  print_coverage(results);
  print_calibration(results);
  if (!s.seconds.empty()) {
    fmt::print("  processor s, median / worst     {:.1f} / {:.1f}\n",
               gap_study::quantile(s.seconds, 0.5), gap_study::quantile(s.seconds, 1.0));
  }
}

// Answers of earlier runs, by engine, case and catalogue.
class Answers {
 public:
  explicit Answers(std::string path) : path_(std::move(path)) {
    if (path_.empty()) return;
    if (std::ifstream in(path_); in) kept_ = json::parse(in);
  }
  template <class Make>
  json get(const std::string& key, Make make) {
    if (!kept_.contains(key)) {
      kept_[key] = make();
      if (!path_.empty()) std::ofstream(path_) << kept_.dump(1);
    }
    return kept_[key];
  }

 private:
  std::string path_;
  json kept_ = json::object();
};

Result result_of(const CaseFiles& files, const std::string& engine, bool taken_out,
                 const Arguments& arguments, Answers& answers) {
  const std::string key =
      engine + " " + files.folder.string() + (taken_out ? " without its names" : "");
  json answer = answers.get(key, [&] {
    Arguments own = arguments;
    if (taken_out) own.without = files.truth.accept;
    if (engine != kEstimator) return answer_of_program(files, engine, own);
    const double began_s = processor_s();
    json made = answer_of_estimator(read_record(files.folder / "record.csv"),
                                    read_model(files.folder / "model.yaml"), own);
    made["seconds"] = processor_s() - began_s;
    return made;
  });
  Answer parsed = gap_study::parse_answer(answer.dump());
  parsed.seconds = answer["seconds"].get<double>();
  gap_study::ScoredCase scored{files.truth, parsed, gap_study::score_case(files.truth, parsed)};
  return {std::move(scored), std::move(answer), taken_out};
}

int run(const Arguments& arguments) {
  Answers answers(arguments.answers);
  std::vector<std::string> engines{kEstimator};
  engines.insert(engines.end(), arguments.programs.begin(), arguments.programs.end());
  for (const std::string& engine : engines) {
    std::vector<Result> results;
    for (const std::string& folder : arguments.cases) {
      for (const CaseFiles& files : gap_study::find_cases(folder)) {
        const std::string name = files.truth.effect + " " + files.truth.id;
        if (name.find(arguments.only) == std::string::npos) continue;
        const bool single = gap_study::kind_of(files.truth) == gap_study::Kind::kSingle;
        for (const bool taken_out : {false, true}) {
          if (taken_out ? !arguments.taken_out || !single : arguments.only_taken_out) continue;
          results.push_back(result_of(files, engine, taken_out, arguments, answers));
          if (arguments.list) print_case(results.back(), files);
        }
      }
    }
    print_table(engine, results);
  }
  return 0;
}

}  // namespace
}  // namespace loopwarden::lab

int main(int argc, char** argv) {
  using namespace loopwarden::lab;
  CLI::App app("Runs the estimator and other programs on hidden cases");
  Arguments arguments;
  app.add_option("--cases", arguments.cases, "folders with truth.json")->required();
  app.add_option("--program", arguments.programs, "programs whose `gap` answers, too");
  app.add_option("--answers", arguments.answers, "file that keeps answers");
  app.add_option("--without", arguments.without, "names that are not given");
  app.add_option("--only", arguments.only, "cases with this text in effect or id");
  app.add_flag("--verbose", arguments.verbose, "print the competition");
  app.add_flag("--list", arguments.list, "one line per case");
  app.add_flag("--taken-out", arguments.taken_out,
               "single effects also with their names taken out of the catalogue");
  app.add_flag("--only-taken-out", arguments.only_taken_out, "these only");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(arguments);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
