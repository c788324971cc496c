// SPDX-License-Identifier: Apache-2.0
// Commissions loops from 20 healthy minutes and a rough model, and explains the change after them.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "config/loop_model_reader.hpp"
#include "config/loop_model_writer.hpp"
#include "lab/gap_study/gap_runner.hpp"
#include "lab/gap_study/score.hpp"
#include "model/numeric/statistics.hpp"
#include "model/plant/plant.hpp"
#include "model/twin/commission.hpp"
#include "model/twin/explain.hpp"
#include "model/watch/controller_watch.hpp"
#include "model/watch/load_watch.hpp"
#include "model/watch/twin_watch.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::studies {
namespace {

namespace fs = std::filesystem;
using lab::gap_study::CaseFiles;
using nlohmann::json;

constexpr double kCommissioned_s = 1200.0;
constexpr double kSure = 0.9;

struct Arguments {
  std::vector<std::string> cases;
  std::string twins;  // folder of twins that are read, or written if they are not there
  std::string only;
  double disturbance = 0.0;  // PV units per root second
  bool no_explanation = false;
  bool verbose = false;
};

void one_thread(std::size_t count, const std::function<void(std::size_t)>& body) {
  for (std::size_t i = 0; i < count; ++i) body(i);
}

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

plant::LoopModel read_model(const fs::path& path) {
  config::Loaded<plant::LoopModel> model = config::read_model_file(path);
  if (!model) throw std::runtime_error(config::to_text(model.diagnostics));
  return *model;
}

struct Scored {
  std::string effect;
  std::string verdict;         // of commission
  double commission_s = 0.0;   // processor
  double left = std::nan("");  // error on the next healthy minutes, over the plant's
  int before = 0;              // alarms before the change
  std::optional<double> seen_s;
  double explain_s = std::nan("");
  std::vector<std::pair<std::string, double>> names;
  bool right = false;
  bool wrong = false;
  bool both = false;
};

// Error of the twin's prediction over that of the plant itself: PV less the twin and a mean over 30
// answers. That mean leaves part of a disturbance, whose intensity is q, PV units per root second.
double left_of(const plant::LoopModel& twin, const numeric::LoopRecord& record, double q) {
  constexpr double kForgets_s = 300.0;  // the disturbance of the cases
  plant::Plant plant(plant::without_noise(twin), 1);
  plant.reset(record.co[0]);
  const double answer_s = std::max(plant::answer_s(twin), record.period_s);
  const double gain = record.period_s / (30.0 * answer_s);
  double level = 0.0;
  double squares = 0.0;
  double count = 0.0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    const double r = record.pv[k] - plant.process_variable();
    const double t = static_cast<double>(k) * record.period_s;
    level += std::max(gain, 1.0 / static_cast<double>(k + 1)) * (r - level);
    if (t > 20.0 * answer_s) {
      squares += (r - level) * (r - level);
      count += 1.0;
    }
    plant.step(record.co[k]);
  }
  const double rounding = twin.transmitter.resolution / std::sqrt(12.0);
  const double disturbance = q / std::sqrt(2.0 / kForgets_s + 2.0 / (30.0 * answer_s));
  return std::sqrt(squares / count) / std::hypot(twin.transmitter.noise, rounding, disturbance);
}

Scored study(const CaseFiles& files, const Arguments& arguments) {
  Scored out;
  out.effect = files.truth.effect;
  record::Record file = record::read_record(files.folder / "record.csv");
  const numeric::LoopRecord record{file.period_s, file.pv, file.sp, file.co};
  const auto samples = [&](double s) {
    return std::min(record.size(), static_cast<std::size_t>(s / record.period_s + 0.5));
  };
  const json truths = json::parse(std::ifstream(files.folder.parent_path() / "truth.json"));
  double from_s = 1e9;
  for (const json& t : truths) {
    if (t["id"] == files.truth.id && t["from_s"].get<double>() > 0.0) from_s = t["from_s"];
  }

  plant::LoopModel twin;
  const fs::path kept = fs::path(arguments.twins) / (files.truth.id + ".yaml");
  if (!arguments.twins.empty() && fs::exists(kept)) {
    twin = read_model(kept);
    out.verdict = "kept";
  } else {
    const double began_s = processor_s();
    const twin::Commissioning made =
        twin::commission({.records = {record.part(0, samples(kCommissioned_s))},
                          .model = read_model(files.folder / "model.yaml")},
                         one_thread, [](double) {});
    out.commission_s = processor_s() - began_s;
    if (arguments.verbose) {
      for (const twin::Stage& stage : made.stages) {
        fmt::print("    {:<24} {:.4g} {:.4g}\n", stage.name, stage.rmse, stage.holdout_rmse);
      }
      if (made.gap) {
        fmt::print("    noise {:.4g} disturbance {:.4g} per root s, floor {:.4g}\n",
                   made.gap->floor.transmitter_rmse, made.gap->load_intensity,
                   made.gap->floor.rmse());
      }
    }
    out.verdict = twin::to_text(made.outcome);
    for (const auto& effect : made.effects) out.verdict += " +" + effect.spec.name;
    if (made.outcome != twin::Outcome::commissioned) {
      out.verdict += ": " + made.why;
      return out;
    }
    twin = made.twin;
    if (!arguments.twins.empty()) {
      fs::create_directories(arguments.twins);
      std::ofstream(kept) << config::write_model(twin);
    }
  }
  const std::size_t first = samples(kCommissioned_s);
  const std::size_t change = samples(from_s);
  out.left = left_of(twin, record.part(first, change), arguments.disturbance);

  watch::TwinWatch watch(twin);
  watch::ControllerWatch controller(twin);
  watch::LoadWatch load(twin);
  std::size_t seen = 0;
  std::size_t alarm = 0;  // of the twin or the controller: a load outside raises none
  bool was_on = false;
  for (std::size_t k = first; k < record.size() && alarm == 0; ++k) {
    watch.add(record.pv[k], record.co[k]);
    controller.add(record.sp[k], record.pv[k], record.co[k]);
    load.add(watch.load_known() ? watch.load() : std::nan(""));
    const bool on = watch.on() || controller.on() || load.outside().has_value();
    if (k < change && on && !was_on) {
      ++out.before;
      if (arguments.verbose) {
        fmt::print("    {:.0f} s before the change: {}{}{}\n",
                   record.period_s * static_cast<double>(change - k), watch.on() ? "twin " : "",
                   controller.on() ? "controller " : "", load.outside() ? "disturbance" : "");
      }
    }
    if (k >= change && on && seen == 0) seen = k;
    if (k >= change && (watch.on() || controller.on())) alarm = k;
    was_on = on;
  }
  if (seen == 0) return out;
  out.seen_s = record.period_s * static_cast<double>(seen - change);
  if (alarm == 0 || arguments.no_explanation) return out;
  const double began_s = processor_s();
  const numeric::LoopRecord newest =
      record.part(first, std::min(record.size(), alarm + samples(twin::kEnough_s)));
  const twin::Explanation e =
      twin::explain(newest, twin, alarm - first, {.enough_s = twin::kMostSeen_s}, one_thread);
  out.explain_s = processor_s() - began_s;
  std::set<std::string> accept(files.truth.accept.begin(), files.truth.accept.end());
  if (accept.contains("output_bias")) accept.insert("step_disturbance");
  if (accept.contains("step_disturbance")) accept.insert("output_bias");
  if (accept.contains("drift")) accept.insert("ramp_disturbance");
  for (const auto& effect : e.result.effects) {
    out.names.emplace_back(effect.spec.name, effect.confidence);
    if (!accept.contains(effect.spec.name)) out.wrong = true;
  }
  out.right = !out.names.empty() && accept.contains(out.names.front().first);
  out.both = out.names.size() == 2 && !out.wrong;
  fmt::print(
      "    {} closed {:.2f} since {:.0f} s ({:.0f} to {:.0f}) after the change\n",
      e.usable() ? e.result.sentence : e.result.check.refusal, e.closed,
      record.period_s * (static_cast<double>(first + e.at) - static_cast<double>(change)),
      record.period_s * (static_cast<double>(first + e.from.begin) - static_cast<double>(change)),
      record.period_s * (static_cast<double>(first + e.from.end) - static_cast<double>(change)));
  if (arguments.verbose) {
    fmt::print("    before {:.4g} {:.4g} after {:.4g} {:.4g} floor {:.4g} noise {:.4g}\n",
               e.result.before.training_rmse, e.result.before.holdout_rmse,
               e.result.after.training_rmse, e.result.after.holdout_rmse, e.result.floor.rmse(),
               e.result.floor.transmitter_rmse);
    for (const auto& c : e.result.candidates) {
      fmt::print("    {:<40} {:.1f} nats, left {:.4g}\n", c.name, c.score, c.rmse);
    }
  }
  for (const auto& effect : e.result.effects) {
    for (const auto& [name, value] : effect.spec.parameters) {
      const auto truth = files.truth.parameters.find(name);
      if (truth == files.truth.parameters.end()) continue;
      const auto range = effect.interval.find(name);
      fmt::print("    {} {:.4g} true {:.4g}", name, value, truth->second);
      if (range != effect.interval.end()) {
        fmt::print(" [{:.4g} {:.4g}]", range->second[0], range->second[1]);
      }
      fmt::print("\n");
    }
  }
  return out;
}

int run(const Arguments& arguments) {
  std::vector<Scored> all;
  for (const std::string& folder : arguments.cases) {
    for (const CaseFiles& files : lab::gap_study::find_cases(folder)) {
      if ((files.truth.effect + " " + files.truth.id).find(arguments.only) == std::string::npos) {
        continue;
      }
      const Scored one = study(files, arguments);
      std::string names;
      for (const auto& [name, confidence] : one.names) {
        names += fmt::format(" {} {:.2f}", name, confidence);
      }
      fmt::print(
          "{} {} {:<34} {} ({:.1f} s) left {:.2f} before {} seen {:.0f} s explain {:.1f} s:{}\n",
          one.right ? " " : "X", files.truth.id, one.effect, one.verdict, one.commission_s,
          one.left, one.before, one.seen_s.value_or(std::nan("")), one.explain_s, names);
      std::fflush(stdout);
      all.push_back(one);
    }
  }
  const auto count = [&](auto&& of) { return std::count_if(all.begin(), all.end(), of); };
  const auto quantile = [&](auto&& of, double share) {
    std::vector<double> values;
    for (const Scored& one : all) {
      if (std::isfinite(of(one)) && of(one) > 0.0) values.push_back(of(one));
    }
    return values.empty() ? std::nan("") : numeric::quantile(values, share);
  };
  const auto twins = count([](const Scored& s) { return std::isfinite(s.left); });
  const auto faulty =
      count([](const Scored& s) { return std::isfinite(s.left) && s.effect != "none"; });
  const auto explained = count([](const Scored& s) { return std::isfinite(s.explain_s); });
  fmt::print("loops {}, commissioned {}\n", all.size(), twins);
  const auto line = [](const char* what, const auto& of) {
    fmt::print("{:<60} {:.2f} {:.2f} {:.2f}\n", what, of(0.5), of(0.9), of(1.0));
  };
  line("remaining error over that of the plant: median, nine tenths, worst",
       [&](double q) { return quantile([](const Scored& s) { return s.left; }, q); });
  line("commission, processor s",
       [&](double q) { return quantile([](const Scored& s) { return s.commission_s; }, q); });
  line("explain, processor s",
       [&](double q) { return quantile([](const Scored& s) { return s.explain_s; }, q); });
  fmt::print(
      "loops with an alarm before the change, or without one {}\n",
      count([](const Scored& s) { return s.before > 0 || (s.effect == "none" && s.seen_s); }));
  fmt::print("change seen {} of {}\n",
             count([](const Scored& s) { return s.effect != "none" && s.seen_s; }), faulty);
  fmt::print("first name right {} of {}; no name {}; a wrong name {}, at 0.9 {}; both of two {}\n",
             count([](const Scored& s) { return s.right; }), explained,
             count([](const Scored& s) { return std::isfinite(s.explain_s) && s.names.empty(); }),
             count([](const Scored& s) { return s.wrong; }), count([](const Scored& s) {
               return !s.right && !s.names.empty() && s.names.front().second >= kSure;
             }),
             count([](const Scored& s) { return s.both; }));
  return 0;
}

}  // namespace
}  // namespace loopwarden::studies

int main(int argc, char** argv) {
  using namespace loopwarden::studies;
  CLI::App app("Commissions loops and explains their changes");
  Arguments arguments;
  app.add_option("--cases", arguments.cases, "folders with truth.json")->required();
  app.add_option("--twins", arguments.twins, "folder that keeps twins");
  app.add_option("--only", arguments.only, "cases with this text in effect or id");
  app.add_option("--disturbance", arguments.disturbance,
                 "disturbance of the cases, PV units per root second");
  app.add_flag("--no-explanation", arguments.no_explanation, "commission and watch only");
  app.add_flag("--verbose", arguments.verbose, "print the competition");
  CLI11_PARSE(app, argc, argv);
  try {
    return run(arguments);
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
}
