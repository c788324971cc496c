// SPDX-License-Identifier: Apache-2.0
// Measures the planner of tests (model/estimator/plan.hpp) on foreign plants and measured records.
#include "lab/plan_study/plan_study.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <ctime>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <utility>

#include "config/loop_model_reader.hpp"
#include "lab/hidden_cases/hidden_case.hpp"
#include "lab/hidden_cases/kinds.hpp"
#include "model/estimator/judge_test.hpp"
#include "model/gap/check.hpp"
#include "model/gap/constants.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::lab::plan_study {
namespace {

using estimator::Estimate;
using estimator::Explanation;
using estimator::Judged;
using estimator::Move;
using estimator::MoveKind;
using estimator::Planned;
using nlohmann::json;
using Names = std::vector<std::string>;

constexpr double kWarmUp = 20.0;  // answer times of the test's record before the move

double processor_s() { return static_cast<double>(std::clock()) / CLOCKS_PER_SEC; }

// --- Cases ---------------------------------------------------------------------------------------

bool accepted(const hidden_cases::HiddenCase& one, const Names& names) {
  // A controller with other settings is no effect of the plant.
  if (one.accept == Names{"none"} || one.effect == "controller_mismatch") return names.empty();
  const auto in_names = [&](const std::string& name) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  const auto count =
      static_cast<std::size_t>(std::count_if(one.accept.begin(), one.accept.end(), in_names));
  if (one.effect.find('+') == std::string::npos) return count > 0 && names.size() == 1;
  return count == one.accept.size() && names.size() == count;
}

class Case {
 public:
  explicit Case(hidden_cases::CaseRequest request)
      : request_(std::move(request)), one_(hidden_cases::make_case(request_)) {
    const std::filesystem::path folder =
        std::filesystem::temp_directory_path() / fmt::format("plan-study-{}", getpid());
    hidden_cases::write_case(folder, one_);
    loop_ = read_loop(folder / one_.id);
    std::filesystem::remove_all(folder);
    estimate_ = estimator::estimate(loop_.observed, loop_.model, {}, one_thread);
    Names chosen;
    for (const estimator::Found& f : estimate_.effects) chosen.push_back(f.spec.name);
    for (std::size_t i = 0; i < estimate_.explanations.size(); ++i) {
      const Explanation& e = estimate_.explanations[i];
      // As in gap: a hypothesis that adds effects to the chosen ones counts for them.
      const bool adds =
          !chosen.empty() && e.effects.size() > chosen.size() &&
          std::all_of(chosen.begin(), chosen.end(), [&](const std::string& name) {
            return std::find(e.effects.begin(), e.effects.end(), name) != e.effects.end();
          });
      if (adds || e.probability < estimator::kCompetes) continue;
      if (explanations_.size() == gap::kMostCompeting) break;
      explanations_.push_back(e);
      index_.push_back(i);
    }
  }

  bool competes() const { return explanations_.size() > 1; }

  json answer(std::size_t fixed_tests) {
    json out{{"id", request_.id}, {"effect", one_.effect}, {"competes", competes()}};
    for (const Explanation& e : explanations_) {
      out["explanations"].push_back({{"effects", e.effects},
                                     {"probability", e.probability},
                                     {"accepted", accepted(one_, e.effects)}});
    }
    if (!competes()) return out;
    const double began = processor_s();
    estimator::TestStart start = start_of(loop_, estimate_);
    const double rest_s =
        estimator::kRest * std::max(plant::answer_s(loop_.model), loop_.observed.period_s);
    start.judge = [&](const estimator::Observed& test, estimator::Drawn from) {
      from.explanation = index_[from.explanation];
      return estimator::among(estimate_.reweighted(test, rest_s, from).probability, index_);
    };
    const Planned planned = estimator::propose_test(explanations_, start, one_thread);
    out["planning_s"] = processor_s() - began;
    out["why_not"] = planned.why_not;
    if (planned.plan) out["plan"] = of(*planned.plan);
    if (planned.best) out["best"] = of(*planned.best);
    if (planned.beyond) out["beyond"] = of(*planned.beyond);
    for (std::size_t i = 0; i < fixed_tests; ++i) out["fixed"].push_back(fixed(i));
    return out;
  }

 private:
  json of(const estimator::TestPlan& plan) const {
    json out = carried_out(plan.move);
    out["right_predicted"] = plan.probability_right;
    out["wrong_predicted"] = plan.probability_wrong;
    out["class"] = plan.class_share;
    out["swing_predicted"] = plan.pv_swing;
    return out;
  }

  // A fixed test: set-point pairs and stairs of the output, 2 and 5 % of span, 8 answer times.
  json fixed(std::size_t i) const {
    const double size = 10.0 * (i % 2 == 0 ? 0.02 : 0.05);
    const MoveKind kind = i / 2 == 0 ? MoveKind::set_point_pair : MoveKind::output_stairs;
    Move move{kind, size, 8.0 * plant::answer_s(loop_.model)};
    const double from = i / 2 == 0 ? loop_.set_point : loop_.observed.co.back();
    if (from + size > 10.0) move.size = -size;
    return carried_out(move);
  }

  json carried_out(const Move& move) const {
    const double period = loop_.observed.period_s;
    const double answer_s = std::max(plant::answer_s(loop_.model), period);
    hidden_cases::CaseRequest request = request_;
    request.test.manual = estimator::in_manual(move.kind);
    request.test.from = static_cast<std::size_t>(kWarmUp * answer_s / period);
    const auto count = static_cast<std::size_t>(estimator::duration_s(move) / period);
    for (std::size_t k = 0; k < count; ++k) {
      request.test.moved.push_back(estimator::moved(move, 0.0, period * static_cast<double>(k)));
    }
    const hidden_cases::HiddenCase after = hidden_cases::make_case(request);
    const estimator::Observed test{period, after.test.co, after.test.pv,
                                   std::vector<bool>(after.test.pv.size(), true)};
    std::vector<Names> names;
    for (const Explanation& e : explanations_) names.push_back(e.effects);
    const Judged judged =
        estimator::judge_test(names, loop_.observed, test, loop_.model, {}, one_thread);
    double swing = 0.0;
    for (std::size_t k = request.test.from; k < test.pv.size(); ++k) {
      swing = std::max(swing, std::abs(test.pv[k] - loop_.set_point));
    }
    json out{{"move", estimator::to_text(move.kind)},
             {"size", move.size},
             {"hold_s", move.hold_s},
             {"duration_s", estimator::duration_s(move)},
             {"swing", swing},
             {"after", judged.probability},
             {"other", judged.other},
             {"likeliest_other", judged.likeliest_other},
             {"explained", judged.explained}};
    // The estimator may find another name than those that competed.
    Names found = judged.likeliest_other;
    double probability = judged.other;
    for (std::size_t i = 0; i < names.size(); ++i) {
      if (judged.probability[i] <= probability) continue;
      probability = judged.probability[i];
      found = names[i];
    }
    const bool decides = probability >= estimator::kDecides;
    const char* decision = accepted(one_, found) ? "right" : "wrong";
    out["decision"] = decides && judged.explained ? decision : "undecided";
    out["without_floor"] = decides ? decision : "undecided";
    return out;
  }

  hidden_cases::CaseRequest request_;
  hidden_cases::HiddenCase one_;
  Loop loop_;
  Estimate estimate_;
  std::vector<Explanation> explanations_;
  std::vector<std::size_t> index_;  // in those of the estimate
};

// --- Table ---------------------------------------------------------------------------------------

struct Counts {
  std::size_t right = 0, wrong = 0, undecided = 0;
  std::vector<double> swing;  // PV units

  void add(const json& test, const char* key = "decision") {
    const std::string decision = test[key];
    ++(decision == "right" ? right : decision == "wrong" ? wrong : undecided);
    swing.push_back(test["swing"]);
  }
  std::size_t all() const { return right + wrong + undecided; }
};

double median(std::vector<double> values) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

void print(const std::string& what, const Counts& c) {
  const auto percent = [&](std::size_t n) {
    return c.all() == 0 ? 0.0 : 100.0 * static_cast<double>(n) / static_cast<double>(c.all());
  };
  fmt::print(
      "  {:<44} {:3} of {:3} right ({:.0f} %), {} wrong ({:.0f} %), {} undecided; PV {:.2f} %\n",
      what, c.right, c.all(), percent(c.right), c.wrong, percent(c.wrong), c.undecided,
      10.0 * median(c.swing));
}

}  // namespace

int study_cases(const Arguments& arguments) {
  std::ofstream out(arguments.out, std::ios::app);
  for (hidden_cases::CaseRequest& request : hidden_cases::plan_cases(
           arguments.count, arguments.seed, hidden_cases::parse_kinds(arguments.kinds),
           arguments.load, arguments.samples)) {
    Case one(std::move(request));
    out << one.answer(arguments.fixed).dump() << std::endl;
  }
  return 0;
}

int print_table(const std::vector<std::string>& files, bool list) {
  std::size_t cases = 0;
  Counts plans, without_floor, truth_inside, inside_wanted;
  std::array<Counts, 4> fixed;
  std::array<Counts, 4> plan_where_fixed;
  std::size_t refused = 0, refused_true = 0;
  std::vector<double> seconds;
  std::array<std::pair<double, double>, 10> tenths{};  // predicted, decided right
  std::array<double, 10> in_tenth{};
  const auto predicted = [&](const json& test) {
    const double p = test["right_predicted"];
    const auto i = static_cast<std::size_t>(std::min(9.0, 10.0 * p));
    tenths[i].first += p;
    tenths[i].second += test["decision"] == "right" ? 1.0 : 0.0;
    in_tenth[i] += 1.0;
  };
  std::vector<json> ambiguous;
  for (const std::string& file : files) {
    std::ifstream in(file);
    for (std::string line; std::getline(in, line);) {
      ++cases;
      json one = json::parse(line);
      if (one["competes"]) ambiguous.push_back(std::move(one));
    }
  }
  for (const json& one : ambiguous) {
    seconds.push_back(one["planning_s"]);
    const bool inside = std::any_of(one["explanations"].begin(), one["explanations"].end(),
                                    [](const json& e) { return e["accepted"].get<bool>(); });
    const json* test = one.contains("plan") ? &one["plan"] : nullptr;
    if (list) {
      const json* shown = test != nullptr ? test : one.contains("best") ? &one["best"] : nullptr;
      fmt::print("{} {:<34} {}", one["id"].get<std::string>(), one["effect"].get<std::string>(),
                 test != nullptr ? "" : "refused ");
      for (const json& e : one["explanations"]) {
        fmt::print("{}{} {:.2f}, ", e["accepted"].get<bool>() ? "*" : "",
                   title(e["effects"].get<Names>()), e["probability"].get<double>());
      }
      if (shown != nullptr) {
        fmt::print("{} {:.3g} {:.0f} s p {:.2f} {:.2f} -> {} {} ({}) {}\n",
                   (*shown)["move"].get<std::string>(), (*shown)["size"].get<double>(),
                   (*shown)["duration_s"].get<double>(), (*shown)["right_predicted"].get<double>(),
                   (*shown)["wrong_predicted"].get<double>(),
                   (*shown)["decision"].get<std::string>(), (*shown)["after"].dump(),
                   (*shown)["explained"].get<bool>() ? "explained" : "unexplained",
                   (*shown)["likeliest_other"].dump());
      } else {
        fmt::print("{}\n", one["why_not"].get<std::string>());
      }
    }
    if (test != nullptr) {
      plans.add(*test);
      without_floor.add(*test, "without_floor");
      if (inside) truth_inside.add(*test);
      predicted(*test);
    } else {
      ++refused;
      bool decides = one.contains("best") && one["best"]["decision"] == "right";
      if (one.contains("best")) predicted(one["best"]);
      for (const json& f : one.value("fixed", json::array())) {
        decides = decides || f["decision"] == "right";
      }
      if (!decides) ++refused_true;
    }
    if (!one.contains("fixed")) continue;
    for (std::size_t i = 0; i < one["fixed"].size(); ++i) {
      fixed[i].add(one["fixed"][i]);
      if (test != nullptr) plan_where_fixed[i].add(*test);
    }
  }
  fmt::print("{} cases, {} with competing explanations\n", cases, ambiguous.size());
  print("planned tests", plans);
  print("planned tests, truth among the explanations", truth_inside);
  print("planned tests, error at the floor not asked", without_floor);
  constexpr std::array<const char*, 4> kFixed{"fixed: SP pair 2 %", "fixed: SP pair 5 %",
                                              "fixed: output stairs 2 %",
                                              "fixed: output stairs 5 %"};
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    if (fixed[i].all() == 0) continue;
    print(kFixed[i], fixed[i]);
    print("  planned tests of the same cases", plan_where_fixed[i]);
  }
  fmt::print("  no test decides: {}, of these true {}\n", refused, refused_true);
  fmt::print("  predicted / observed right decisions, by tenths (tests):");
  for (std::size_t i = 0; i < tenths.size(); ++i) {
    if (in_tenth[i] == 0.0) continue;
    fmt::print(" {:.2f} / {:.2f} ({:.0f})", tenths[i].first / in_tenth[i],
               tenths[i].second / in_tenth[i], in_tenth[i]);
  }
  fmt::print("\n  planning, processor s: median {:.1f}, worst {:.1f}\n", median(seconds),
             seconds.empty() ? 0.0 : *std::max_element(seconds.begin(), seconds.end()));
  return 0;
}

Loop read_loop(const std::filesystem::path& folder) {
  const config::Loaded<plant::LoopModel> model = config::read_model_file(folder / "model.yaml");
  if (!model) throw std::runtime_error(config::to_text(model.diagnostics));
  const gap::CheckedRecord checked = gap::check(record::read_record(folder / "record.csv"), *model);
  if (!checked.quality.usable) throw std::runtime_error(folder.string() + ": not usable");
  Loop loop{
      {checked.record.period_s, checked.co, checked.pv, checked.measured}, checked.model, 0.0};
  loop.model.transmitter.resolution = model->transmitter.resolution;
  loop.set_point = checked.record.has_sp() ? checked.record.sp.back() : loop.observed.pv.back();
  return loop;
}

std::string title(const std::vector<std::string>& effects) {
  std::string text;
  for (const std::string& e : effects) text += (text.empty() ? "" : "+") + e;
  return text.empty() ? "none" : text;
}

estimator::TestStart start_of(const Loop& loop, const Estimate& e) {
  const control::PidSettings& pid = loop.model.controller.pid;
  const plant::TransmitterParameters& pv = loop.model.transmitter;
  const auto chosen = std::find_if(e.ranked.begin(), e.ranked.end(),
                                   [&](const estimator::Ranked& r) { return r.title == e.chosen; });
  return {.set_point = loop.set_point,
          .output = loop.observed.co.back(),
          .set_points = {pv.low, pv.high},
          .outputs = {pid.output_low, pid.output_high},
          .noise_rms = e.noise_rms,
          .disturbance = chosen != e.ranked.end() ? chosen->error.disturbance : 0.0,
          .law_error = e.law_error};
}

}  // namespace loopwarden::lab::plan_study
