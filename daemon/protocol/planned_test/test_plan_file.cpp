// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/planned_test/test_plan_file.hpp"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <ctime>
#include <nlohmann/json.hpp>
#include <utility>

#include "base/text.hpp"
#include "config/document.hpp"

namespace loopwarden::protocol {
namespace {

using config::MapReader;
using config::Value;
using estimator::MoveKind;

constexpr double kLongest_s = 3600.0;  // as the daemon's
constexpr std::size_t kMostExplanations = 3;
constexpr std::array kMoves{MoveKind::set_point_pair,   MoveKind::set_point_reversal,
                            MoveKind::set_point_stairs, MoveKind::set_point_ramp,
                            MoveKind::output_pair,      MoveKind::output_reversal,
                            MoveKind::output_stairs,    MoveKind::output_ramp};

std::optional<std::uint32_t> crc_of(const std::string& text) {
  std::uint32_t value = 0;
  const char* const end = text.data() + text.size();
  const auto [at, wrong] = std::from_chars(text.data(), end, value, 16);
  if (text.size() != 8 || at != end || wrong != std::errc()) return std::nullopt;
  return value;
}

std::optional<std::int64_t> utc_time(const std::string& text) {
  std::tm time{};
  const char* const end = ::strptime(text.c_str(), "%Y-%m-%dT%H:%M:%SZ", &time);
  if (end == nullptr || *end != '\0') return std::nullopt;
  return ::timegm(&time);
}

std::vector<std::string> words_of_moves() {
  std::vector<std::string> words;
  for (const MoveKind kind : kMoves) words.emplace_back(estimator::to_text(kind));
  return words;
}

class PlanReader {
 public:
  explicit PlanReader(MapReader root) : root_(std::move(root)) {}

  TestPlanFile read() {
    plan_.loop = root_.text("loop", "tag of the loop in the daemon", "");
    read_configuration();
    read_time();
    plan_.model = root_.need_text("model", "loop model of the planning");
    plan_.record = root_.need_text("record", "record of the planning, next to this file");
    plan_.without = root_.maybe_texts("without", "names that the planning left out");
    root_.set_flag("level_of_record", "the model's level of PV is not valid",
                   plan_.level_of_record);
    read_explanations();
    read_move();
    root_.need_section("limits", "outside of them the test ends",
                       [&](MapReader& in) { read_limits(in); });
    root_.need_section("expected", "of simulated tests", [&](MapReader& in) {
      plan_.probability_right = in.need_number(
          "probability_right", {"", config::between(0.0, 1.0), "of a right decision"});
      plan_.probability_wrong = in.need_number(
          "probability_wrong", {"", config::between(0.0, 1.0), "of a wrong decision"});
      plan_.pv_swing = in.need_number(
          "pv_swing", {"PV units", config::at_least(0.0), "largest deviation from SP"});
      plan_.output_swing = in.need_number(
          "output_swing",
          {"CO units", config::at_least(0.0), "largest deviation from the output before"});
    });
    return std::move(plan_);
  }

 private:
  void read_configuration() {
    const Value<std::string> text =
        root_.text("configuration", "CRC-32 of the loop's file, eight hexadecimal digits", "");
    if (!text.given || !text.valid) return;
    plan_.configuration = crc_of(text.value);
    if (!plan_.configuration) {
      root_.error("configuration",
                  fmt::format("must be eight hexadecimal digits in quotes (got '{}')",
                              config::quotable(text.value)));
    }
  }

  void read_time() {
    const Value<std::string> text = root_.need_text("planned_at", "UTC, 2026-11-29T00:21:24Z");
    if (!text.given || !text.valid) return;
    if (const std::optional<std::int64_t> time = utc_time(text.value)) {
      plan_.planned_at = *time;
    } else {
      root_.error("planned_at", fmt::format("must be a UTC time, 2026-11-29T00:21:24Z (got '{}')",
                                            config::quotable(text.value)));
    }
  }

  void read_explanations() {
    for (MapReader& in : root_.maybe_list("explanations", "explanations that the test separates")) {
      PlannedExplanation one;
      one.effects =
          in.maybe_texts("effects", "effects together; []: nothing is missing", "[effect, ...]");
      one.probability =
          in.need_number("probability", {"", config::between(0.0, 1.0), "before the test"});
      const Value<std::vector<std::vector<double>>> table =
          in.maybe_table("pv", "[s, PV units, PV units]",
                         "time, lowest and highest PV of 90 % of simulated tests");
      for (const std::vector<double>& row : table.value) {
        if (row.size() == 3) {
          one.pv.push_back({row[0], row[1], row[2]});
        } else {
          in.error("pv", "each row needs a time, a lowest and a highest PV");
          break;
        }
      }
      plan_.explanations.push_back(std::move(one));
    }
    const std::size_t count = plan_.explanations.size();
    if (!root_.describing() && (count < 2 || count > kMostExplanations)) {
      root_.error("explanations",
                  fmt::format("must be 2 to {} (got {})", kMostExplanations, count));
    }
  }

  void read_move() {
    const Value<std::string> word =
        root_.need_word("move", words_of_moves(), "of SP in automatic, or of the output in manual");
    plan_.move.kind = estimator::move_from_text(word.value).value_or(MoveKind::set_point_pair);
    plan_.from = root_.need_number(
        "from", {"PV or CO units", config::any_number(), "SP or output before the test"});
    const Value<double> size = root_.need_number(
        "size", {"PV or CO units", config::any_number(), "largest distance from `from`, not 0"});
    if (size.given && size.valid && size == 0.0) root_.error("size", "must not be 0");
    plan_.move.size = size;
    plan_.move.hold_s = root_.need_number(
        "hold", {"s", config::above(0.0), "duration of each step, or of each way of a ramp"});
    if (const double all = estimator::duration_s(plan_.move); !(all <= kLongest_s)) {
      root_.error("hold", fmt::format("the test lasts {:.4g} s; it must be at most {:g} s", all,
                                      kLongest_s));
    }
  }

  void read_limits(MapReader& in) {
    const auto pv =
        in.need_range("pv", {"PV units", config::any_number(), "lowest and highest PV"});
    const auto co =
        in.need_range("co", {"CO units", config::any_number(), "lowest and highest output"});
    plan_.pv_limits = {pv.value.first, pv.value.second};
    plan_.co_limits = {co.value.first, co.value.second};
    const bool manual = estimator::in_manual(plan_.move.kind);
    const auto& ends = manual ? co : pv;
    if (!ends.given || !ends.valid) return;
    const double farthest = std::abs(plan_.move.size);
    if (plan_.from - farthest < ends.value.first - 1e-9 ||
        plan_.from + farthest > ends.value.second + 1e-9) {
      in.error(
          manual ? "co" : "pv",
          fmt::format("must contain from - size to from + size, {} to {}",
                      config::brief(plan_.from - farthest), config::brief(plan_.from + farthest)));
    }
  }

  MapReader root_;
  TestPlanFile plan_;
};

std::string yaml_text(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

std::string list_of(const std::vector<std::string>& texts) {
  std::string list;
  for (const std::string& text : texts) list += (list.empty() ? "" : ", ") + yaml_text(text);
  return "[" + list + "]";
}

}  // namespace

config::Loaded<TestPlanFile> read_test_plan_text(const std::string& file, std::string_view text) {
  return config::load_text<TestPlanFile>(file, text,
                                         [](MapReader& in) { return PlanReader(in).read(); });
}

config::Loaded<TestPlanFile> read_test_plan(const std::filesystem::path& path) {
  return config::load_file(path, read_test_plan_text);
}

config::KeyReference describe_test_plan() {
  return config::keys_of([](MapReader& in) { PlanReader(in).read(); });
}

std::string title_of(const std::vector<std::string>& effects) {
  if (effects.empty()) return "nothing missing";
  std::string title;
  for (const std::string& name : effects) {
    const std::string words = name == "unnamed" ? "an unknown effect" : base::in_words(name);
    title += (title.empty() ? "" : " + ") + words;
  }
  return title;
}

std::string names_of(const TestPlanFile& plan) {
  std::string names;
  for (std::size_t i = 0; i < plan.explanations.size(); ++i) {
    const bool last = i + 1 == plan.explanations.size();
    names += (i == 0 ? "" : last ? " or " : ", ") + title_of(plan.explanations[i].effects);
  }
  return names;
}

std::string utc_time_text(std::int64_t seconds) {
  return fmt::format("{:%FT%TZ}", fmt::gmtime(static_cast<std::time_t>(seconds)));
}

std::string write_test_plan(const TestPlanFile& plan, const std::string& heading) {
  const char* const unit = estimator::in_manual(plan.move.kind) ? "CO units" : "PV units";
  std::string text = heading.empty() ? "" : "# " + heading + "\n";
  if (!plan.loop.empty()) text += "loop: " + yaml_text(plan.loop) + "\n";
  if (plan.configuration) text += fmt::format("configuration: \"{:08x}\"\n", *plan.configuration);
  text += fmt::format("planned_at: \"{}\"\nmodel: {}\nrecord: {}\n", utc_time_text(plan.planned_at),
                      yaml_text(plan.model), yaml_text(plan.record));
  if (!plan.without.empty()) text += "without: " + list_of(plan.without) + "\n";
  if (plan.level_of_record) text += "level_of_record: true\n";
  text += fmt::format(
      "move: {}\nfrom: {}  # {}\nsize: {}  # {}\nhold: {}  # s\n"
      "limits: {{pv: [{}, {}], co: [{}, {}]}}\n"
      "expected: {{probability_right: {}, probability_wrong: {}, pv_swing: {}, output_swing: {}}}\n"
      "explanations:\n",
      estimator::to_text(plan.move.kind), plan.from, unit, plan.move.size, unit, plan.move.hold_s,
      plan.pv_limits[0], plan.pv_limits[1], plan.co_limits[0], plan.co_limits[1],
      plan.probability_right, plan.probability_wrong, plan.pv_swing, plan.output_swing);
  for (const PlannedExplanation& e : plan.explanations) {
    text +=
        fmt::format("  - effects: {}\n    probability: {}\n", list_of(e.effects), e.probability);
    if (e.pv.empty()) continue;
    std::string rows;
    for (const auto& [time, low, high] : e.pv) {
      rows += fmt::format("{}[{}, {}, {}]", rows.empty() ? "" : ", ", time, low, high);
    }
    text += "    pv: [" + rows + "]\n";
  }
  return text;
}

}  // namespace loopwarden::protocol
