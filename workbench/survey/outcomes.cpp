// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/outcomes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <nlohmann/json.hpp>
#include <tuple>

#include "base/clock.hpp"
#include "base/file.hpp"
#include "base/text.hpp"
#include "config/diagnostic.hpp"
#include "model/numeric/statistics.hpp"
#include "daemon/protocol/requests.hpp"
#include "record/import/number_text.hpp"
#include "record/import/time_text.hpp"
#include "workbench/files/command_error.hpp"
#include "workbench/files/csv_log.hpp"
#include "workbench/text/csv_text.hpp"

namespace loopwarden::workbench {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::size_t kMostBytes = 64UL * 1024UL * 1024UL;
constexpr const auto& kAtValveWords = protocol::kFoundWords;
constexpr std::array kOutcomeColumns{"answered",        "tag",         "found",     "note",
                                     "verdict",         "grade",       "effect",    "alternatives",
                                     "percent_of_span", "probability", "data_from", "data_to"};
struct OutcomeColumn {
  enum Place : std::size_t {
    answered,
    tag,
    found,
    note,
    verdict,
    grade,
    effect,
    alternatives,
    percent_of_span,
    probability,
    data_from,
    data_to
  };
};

std::string text_at(const json& object, const char* key) {
  const auto at = object.find(key);
  return at != object.end() && at->is_string() ? at->get<std::string>() : std::string();
}

std::optional<double> number_at(const json& object, const char* key) {
  const auto at = object.find(key);
  return at != object.end() && at->is_number() ? std::optional(at->get<double>()) : std::nullopt;
}

std::string number_text(const std::optional<double>& number) {
  return number ? fmt::format("{:.6g}", *number) : std::string();
}

std::string line_of(const FitterAnswer& o) {
  const std::array<std::string, kOutcomeColumns.size()> cells{o.answered,
                                                              o.tag,
                                                              to_text(o.found),
                                                              o.note,
                                                              o.verdict,
                                                              o.grade,
                                                              o.effect,
                                                              o.alternatives,
                                                              number_text(o.percent_of_span),
                                                              number_text(o.probability),
                                                              o.data_from,
                                                              o.data_to};
  std::string line;
  for (const std::string& cell : cells) line += (line.empty() ? "" : ",") + csv_cell(cell);
  return line;
}

// Returns the key of a finding: the same effect of the same size at the same loop.
auto finding_of(const FitterAnswer& o) {
  return std::tuple(o.tag, o.effect, o.percent_of_span.value_or(0.0), o.data_to);
}

FitterAnswer read_row(const CsvTable& table, const CsvRow& row) {
  FitterAnswer o;
  const auto& cell = row.cells;
  o.answered = cell[OutcomeColumn::answered];
  o.tag = cell[OutcomeColumn::tag];
  if (o.tag.empty()) table.fail_at(row, OutcomeColumn::tag, "no tag");
  const auto word = found_from(base::lower_case(cell[OutcomeColumn::found]));
  if (!word) {
    table.fail_at(row, OutcomeColumn::found,
                  fmt::format("{} is none of {}{}", base::in_quotes(cell[OutcomeColumn::found]),
                              fmt::join(kAtValveWords, ", "),
                              config::suggestion(cell[OutcomeColumn::found], found_words())));
  }
  o.found = *word;
  o.note = cell[OutcomeColumn::note];
  o.verdict = cell[OutcomeColumn::verdict];
  o.grade = cell[OutcomeColumn::grade];
  o.effect = cell[OutcomeColumn::effect];
  o.alternatives = cell[OutcomeColumn::alternatives];
  const auto number = [&](OutcomeColumn::Place column) -> std::optional<double> {
    if (cell[column].empty()) return std::nullopt;
    const auto value = record::parse_number(cell[column], table.decimal);
    if (!value) table.fail_at(row, column, base::in_quotes(cell[column]) + " is not a number");
    return value;
  };
  o.percent_of_span = number(OutcomeColumn::percent_of_span);
  o.probability = number(OutcomeColumn::probability);
  o.data_from = cell[OutcomeColumn::data_from];
  o.data_to = cell[OutcomeColumn::data_to];
  return o;
}

// Returns whether a survey may have named this effect for the fitter's finding.
bool is_named(AtValve found, std::string_view effect) {
  switch (found) {
    case AtValve::stiction:
      return effect == "stiction" || effect == "cam_obstruction" ||
             effect == "intermittent_stiction" || effect == "resolution";
    case AtValve::backlash: return effect == "backlash" || effect == "hysteresis";
    case AtValve::air: return effect == "low_air_supply";
    default: return false;
  }
}

}  // namespace

const char* to_text(AtValve found) noexcept {
  return kAtValveWords[static_cast<std::size_t>(found)];
}

std::optional<AtValve> found_from(std::string_view word) noexcept {
  for (const AtValve found : kAtValve) {
    if (word == to_text(found)) return found;
  }
  return std::nullopt;
}

std::vector<std::string> found_words() { return {kAtValveWords.begin(), kAtValveWords.end()}; }

bool FitterAnswer::right() const {
  std::string_view rest = alternatives;
  if (is_named(found, effect)) return true;
  while (!rest.empty()) {
    const std::size_t end = std::min(rest.find(' '), rest.size());
    if (is_named(found, rest.substr(0, end))) return true;
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  return false;
}

std::vector<FitterAnswer> read_outcomes(const fs::path& path) {
  const std::optional<std::string> text = base::read_file(path, kMostBytes);
  if (!text) {
    if (errno == ENOENT) return {};
    fail_csv(path, "can't be read", errno);
  }
  std::vector<CsvColumn> columns;
  for (const char* name : kOutcomeColumns) columns.push_back({name, false});
  columns[OutcomeColumn::tag].needed = columns[OutcomeColumn::found].needed = true;
  const CsvTable table = read_csv(path.string(), *text, columns);
  std::vector<FitterAnswer> outcomes;
  for (const CsvRow& row : table.rows) {
    FitterAnswer outcome = read_row(table, row);
    std::erase_if(outcomes,
                  [&](const FitterAnswer& o) { return finding_of(o) == finding_of(outcome); });
    outcomes.push_back(std::move(outcome));
  }
  return outcomes;
}

void keep_outcome(const fs::path& path, const FitterAnswer& outcome) {
  append_csv_line(path, fmt::format("{}", fmt::join(kOutcomeColumns, ",")), line_of(outcome));
}

std::string moment_of(const json& loop, double s) {
  const std::string start = text_at(loop.at("import"), "start");
  const auto at = record::parse_time(start, record::TimeForm::ymd);
  if (!at) return fmt::format("{:.6g}", s);
  const double whole = std::floor(at->rest_s + s);
  return record::iso_text(at->whole_s + static_cast<std::int64_t>(whole), at->rest_s + s - whole,
                          start.ends_with('Z'));
}

FitterAnswer answer_for(const json& loop, AtValve found, const std::string& note) {
  FitterAnswer o;
  const std::int64_t now_ms = base::utc_ms();
  o.answered = record::iso_text(now_ms / 1000, 0.0, true);
  o.tag = loop.at("tag").get<std::string>();
  o.found = found;
  o.note = note;
  // A row must be one line.
  std::replace_if(
      o.note.begin(), o.note.end(), [](char c) { return static_cast<unsigned char>(c) < ' '; },
      ' ');
  o.verdict = text_at(loop, "verdict");
  o.grade = text_at(loop, "grade");
  o.probability = number_at(loop, "probability");
  if (!loop.at("effects").empty()) {
    const json& effect = loop.at("effects").at(0);
    o.effect = text_at(effect, "name");
    o.percent_of_span = number_at(effect, "percent_of_span");
    for (const json& other : effect.value("alternatives", json::array())) {
      o.alternatives += (o.alternatives.empty() ? "" : " ") +
                        (other.is_string() ? other.get<std::string>() : text_at(other, "name"));
    }
  }
  const json& windows = loop.at("windows");
  if (!windows.empty()) {
    o.data_from = moment_of(loop, windows.front().at("from_s").get<double>());
    o.data_to = moment_of(loop, windows.back().at("to_s").get<double>());
  }
  return o;
}

void tell_outcomes(std::vector<json>& loops, const std::vector<FitterAnswer>& outcomes) {
  for (json& loop : loops) {
    loop["outcome"] = nullptr;
    loop["held_back"] = false;
    const auto newest =
        std::find_if(outcomes.rbegin(), outcomes.rend(),
                     [&](const FitterAnswer& o) { return loop.at("tag") == o.tag; });
    if (newest == outcomes.rend()) continue;
    const auto number = [](const std::optional<double>& value) {
      return value ? json(*value) : json(nullptr);
    };
    loop["outcome"] = {{"answered", newest->answered},
                       {"found", to_text(newest->found)},
                       {"note", newest->note},
                       {"effect", newest->effect.empty() ? json(nullptr) : json(newest->effect)},
                       {"percent_of_span", number(newest->percent_of_span)}};
    if (newest->found != AtValve::nothing || loop.at("effects").empty() || !newest->percent_of_span)
      continue;
    const json& effect = loop.at("effects").at(0);
    const auto size = number_at(effect, "percent_of_span");
    loop["held_back"] = text_at(effect, "name") == newest->effect && size &&
                        *size < kGrown * *newest->percent_of_span;
  }
}

json precision_json(const std::vector<FitterAnswer>& outcomes) {
  json list = json::array();
  for (const char* grade : {"seen", "likely"}) {
    std::size_t right = 0;
    std::size_t of = 0;
    for (const FitterAnswer& o : outcomes) {
      if (o.verdict != "valve_effect" || o.grade != grade) continue;
      ++of;
      right += static_cast<std::size_t>(o.right());
    }
    const numeric::Range range = numeric::wilson_interval(right, of);
    const auto percent = [](double share) { return std::nearbyint(1000.0 * share) / 10.0; };
    list.push_back({{"grade", grade},
                    {"right", right},
                    {"of", of},
                    {"low_percent", percent(range.low)},
                    {"high_percent", percent(range.high)}});
  }
  return {{"answered", outcomes.size()}, {"precision", list}};
}

std::string precision_text(const json& precision) {
  if (precision.is_null() || precision.at("answered") == 0) return {};
  std::string text;
  for (const json& grade : precision.at("precision")) {
    if (grade.at("of") == 0) continue;
    text += fmt::format("{}{}: {} of {} ({:.0f} to {:.0f} %)", text.empty() ? "" : "; ",
                        grade.at("grade").get<std::string>(), grade.at("right").get<std::size_t>(),
                        grade.at("of").get<std::size_t>(), grade.at("low_percent").get<double>(),
                        grade.at("high_percent").get<double>());
  }
  return fmt::format("{} answered by outcome; of the valve effects right: {}",
                     precision.at("answered").get<std::size_t>(),
                     text.empty() ? "none named" : text);
}

}  // namespace loopwarden::workbench
