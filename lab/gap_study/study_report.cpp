// SPDX-License-Identifier: Apache-2.0
#include "lab/gap_study/study_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>

namespace loopwarden::lab::gap_study {
namespace {

using nlohmann::json;

// A share of cases in percent, or a number without an interval.
struct Figure {
  std::optional<Share> share;
  std::optional<double> value;
  std::size_t of = 0;
};

struct Row {
  std::string_view key;
  std::string_view what;
  // Target values, without and with load.
  std::string_view aim;
  std::string_view aim_load;
  std::string_view unit;
  std::function<Figure(const Summary&)> figure;
};

Figure share_of(const Share& share) {
  Figure figure;
  figure.share = share;
  figure.of = share.of;
  return figure;
}

Figure quantile_of(const std::vector<double>& values, double part, double scale) {
  Figure figure;
  figure.of = values.size();
  if (!values.empty()) figure.value = scale * quantile(values, part);
  return figure;
}

const std::vector<Row>& rows() {
  static const std::vector<Row> all{
      {"single_right", "single effects named right", ">= 97", ">= 92", "%",
       [](const Summary& s) { return share_of(s.single_right); }},
      {"none_named", "'none' cases in which an effect is named", "0", "<= 5", "%",
       [](const Summary& s) { return share_of(s.none_named); }},
      {"pair_right", "two effects: both named and no other", ">= 90", ">= 80", "%",
       [](const Summary& s) { return share_of(s.pair_right); }},
      {"closed_median", "holdout gap closed, median", ">= 97", ">= 90", "%",
       [](const Summary& s) { return quantile_of(s.closed, 0.5, 100.0); }},
      {"closed_worst_tenth", "holdout gap closed, worst tenth", ">= 85", ">= 60", "%",
       [](const Summary& s) { return quantile_of(s.closed, 0.1, 100.0); }},
      {"parameter_error_median", "parameters, median relative error", "<= 10", "<= 20", "%",
       [](const Summary& s) { return quantile_of(s.parameter_errors, 0.5, 100.0); }},
      {"confident_right", "names with confidence >= 0.9 that are right", ">= 95", ">= 95", "%",
       [](const Summary& s) { return share_of(s.confident_right); }},
      {"right_confident", "right names that carry >= 0.9", ">= 60", ">= 40", "%",
       [](const Summary& s) { return share_of(s.right_confident); }},
      {"outside_unexplained", "outside at first: unexplained, or the name of now", ">= 90", ">= 80",
       "%", [](const Summary& s) { return share_of(s.outside_unexplained); }},
      {"seconds_median", "processor time per record, median", "", "", "s",
       [](const Summary& s) { return quantile_of(s.seconds, 0.5, 1.0); }},
      {"seconds_worst", "processor time per record, worst", "<= 10", "<= 20", "s",
       [](const Summary& s) { return quantile_of(s.seconds, 1.0, 1.0); }},
  };
  return all;
}

std::string figure_text(const Row& row, const Figure& figure) {
  if (figure.of == 0) return "-";
  if (figure.share) {
    const auto [low, high] = figure.share->interval();
    return fmt::format("{:5.1f} %  {}/{}  [{:.1f}, {:.1f}]", figure.share->percent(),
                       figure.share->hits, figure.share->of, low, high);
  }
  return fmt::format("{:5.1f} {}  of {}", *figure.value, row.unit, figure.of);
}

std::string rmse_text(const std::optional<double>& rmse) {
  return rmse ? fmt::format("{:.4f}", *rmse) : "-";
}

// Returns the best candidates that were not chosen.
std::string runners_up(const Answer& answer) {
  std::vector<std::pair<std::string, double>> rest;
  for (const auto& candidate : answer.candidates) {
    const bool chosen = std::any_of(answer.effects.begin(), answer.effects.end(),
                                    [&](const auto& e) { return e.name == candidate.first; });
    if (!chosen && !std::isnan(candidate.second)) rest.push_back(candidate);
  }
  std::stable_sort(rest.begin(), rest.end(),
                   [](const auto& a, const auto& b) { return a.second < b.second; });
  std::string text;
  for (std::size_t i = 0; i < std::min<std::size_t>(rest.size(), 2); ++i) {
    text += fmt::format(" {} {:.4f}", rest[i].first, rest[i].second);
  }
  return text;
}

std::string answer_text(const Answer& answer) {
  if (!answer.failure.empty()) return "failed: " + answer.failure;
  std::string text = answer.verdict;
  for (const NamedEffect& effect : answer.effects) {
    text += fmt::format(" {}({:.2f})", effect.name, effect.confidence);
  }
  return text;
}

json case_json(const ScoredCase& one) {
  json names = json::array();
  for (const NamedEffect& effect : one.answer.effects) {
    names.push_back({{"name", effect.name},
                     {"confidence", effect.confidence},
                     {"parameters", effect.parameters}});
  }
  const auto number = [](const std::optional<double>& value) {
    return value ? json(*value) : json(nullptr);
  };
  return {{"id", one.truth.id},
          {"truth", one.truth.effect},
          {"accept", one.truth.accept},
          {"note", one.truth.note},
          {"verdict", one.answer.verdict},
          {"failure", one.answer.failure},
          {"names", names},
          {"right", one.score.right},
          {"before", number(one.answer.before)},
          {"after", number(one.answer.after)},
          {"floor", one.truth.floor_rmse},
          {"closed", number(one.score.closed)},
          {"parameter_errors", one.score.parameter_errors},
          {"seconds", number(one.answer.seconds)}};
}

json figure_json(const Figure& figure) {
  json entry{{"of", figure.of}};
  if (figure.of == 0) return entry;
  if (figure.share) {
    const auto [low, high] = figure.share->interval();
    entry["hits"] = figure.share->hits;
    entry["value"] = figure.share->percent();
    entry["interval"] = {low, high};
  } else {
    entry["value"] = *figure.value;
  }
  return entry;
}

}  // namespace

std::string table_text(const std::vector<StudyPart>& parts) {
  std::string text = fmt::format("{:<46}", "");
  std::vector<Summary> summaries;
  for (const StudyPart& part : parts) {
    summaries.push_back(summarise(part.cases));
    const Summary& last = summaries.back();
    std::string head = fmt::format("{}: {} cases", part.name, last.cases);
    if (last.failures > 0) head += fmt::format(", {} failed", last.failures);
    text += fmt::format("{:<44}", head);
  }
  text += '\n';
  for (const Row& row : rows()) {
    text += fmt::format("{:<46}", row.what);
    for (std::size_t i = 0; i < parts.size(); ++i) {
      const std::string figure = figure_text(row, row.figure(summaries[i]));
      const std::string_view aim = parts[i].load ? row.aim_load : row.aim;
      text += fmt::format("{:<33}", figure);
      text += fmt::format("{:<11}", aim.empty() ? "" : fmt::format("({})", aim));
    }
    text += '\n';
  }
  return text;
}

std::string confidence_text(const StudyPart& part) {
  constexpr std::array kClasses{0.0, 0.5, 0.7, 0.8, 0.9, 0.95, 1.0};
  std::string text = fmt::format("{}: confidence -> right\n", part.name);
  for (std::size_t i = 0; i + 1 < kClasses.size(); ++i) {
    Share right;
    double sum = 0.0;
    for (const ScoredCase& one : part.cases) {
      for (const auto& [confidence, is_right] : one.score.names) {
        if (confidence < kClasses[i] || confidence >= kClasses[i + 1]) continue;
        right.count(is_right);
        sum += confidence;
      }
    }
    if (right.of == 0) continue;
    const auto [low, high] = right.interval();
    text += fmt::format("  {:.2f} to {:.2f}, mean {:.3f} {:>26.1f} %  {}/{}  [{:.1f}, {:.1f}]\n",
                        kClasses[i], kClasses[i + 1], sum / static_cast<double>(right.of),
                        right.percent(), right.hits, right.of, low, high);
  }
  return text;
}

std::string confusion_text(const StudyPart& part) {
  std::string text = fmt::format("{}: truth -> answers\n", part.name);
  for (const auto& [truth, answers] : summarise(part.cases).confusion) {
    text += fmt::format("  {:<42}", truth);
    for (const auto& [label, count] : answers) text += fmt::format(" {} {} ", count, label);
    text += '\n';
  }
  return text;
}

std::string list_text(const StudyPart& part) {
  std::string text;
  for (const ScoredCase& one : part.cases) {
    const bool counts = one.score.counts;
    text += fmt::format(
        "{:<8} {} {:<34} -> {:<50} before {} after {} floor {:.4f} closed {}{}; next{} {}\n",
        one.truth.id, one.score.right ? "ok  " : (counts ? "MISS" : "(-) "), one.truth.effect,
        answer_text(one.answer), rmse_text(one.answer.before), rmse_text(one.answer.after),
        one.truth.floor_rmse, rmse_text(one.score.closed),
        one.answer.seconds ? fmt::format(" {:.1f} s", *one.answer.seconds) : "",
        runners_up(one.answer), one.truth.note.empty() ? "" : fmt::format("({})", one.truth.note));
  }
  return text;
}

std::string study_json(const std::vector<StudyPart>& parts) {
  json root = json::object();
  for (const StudyPart& part : parts) {
    const Summary summary = summarise(part.cases);
    json& entry = root[part.load ? "load" : "no_load"];
    entry["cases"] = json::array();
    for (const ScoredCase& one : part.cases) entry["cases"].push_back(case_json(one));
    entry["failures"] = summary.failures;
    for (const Row& row : rows()) {
      entry["figures"][std::string(row.key)] = figure_json(row.figure(summary));
    }
    entry["confusion"] = summary.confusion;
  }
  return root.dump(1) + "\n";
}

}  // namespace loopwarden::lab::gap_study
