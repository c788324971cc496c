// SPDX-License-Identifier: Apache-2.0
#include "daemon/explain/explanation_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <vector>

#include "base/file.hpp"

namespace loopwarden::daemon {
namespace {

using alarm::AlarmKind;
using nlohmann::json;

AlarmKind kind_of(const json& name) {
  const auto found = std::find_if(alarm::kValveAlarms.begin(), alarm::kValveAlarms.end(),
                                  [&](AlarmKind kind) { return name == alarm::to_text(kind); });
  if (found == alarm::kValveAlarms.end()) throw std::runtime_error("unknown alarm");
  return *found;
}

// Returns nullopt for an unknown name.
std::optional<effects::Block> block_of(const std::string& name) {
  using effects::Block;
  for (const Block block :
       {Block::controller, Block::valve, Block::process, Block::transmitter, Block::disturbance}) {
    if (name == effects::to_text(block)) return block;
  }
  return std::nullopt;
}

double number_of(const json& j) { return j.is_null() ? Explanation::kNone : j.get<double>(); }

// Returns the stick of gap's effect stiction, if it is among the effects. A null number is unknown.
std::optional<twin::Stick> stick_of(const json& effects) {
  const auto stiction = std::find_if(effects.begin(), effects.end(), [](const json& effect) {
    return effect.at("name") == "stiction";
  });
  if (stiction == effects.end()) return std::nullopt;
  const auto numbers = [](const json& all) {
    std::map<std::string, double> known;
    for (const auto& [name, value] : all.items()) {
      if (value.is_number()) known[name] = value.get<double>();
    }
    return known;
  };
  std::map<std::string, std::array<double, 2>> interval;
  for (const auto& [name, ends] : stiction->at("interval").items()) {
    if (!ends.at(0).is_number() || !ends.at(1).is_number()) continue;
    interval[name] = {ends.at(0).get<double>(), ends.at(1).get<double>()};
  }
  std::vector<std::string> alternatives;
  for (const json& effect : effects) {
    for (const json& name : effect.at("alternatives")) alternatives.push_back(name);
  }
  return twin::stick_of(numbers(stiction->at("parameters")), interval,
                        number_of(stiction->at("confidence")), alternatives);
}

// Returns the state of a slip, from the newest search for its move (`valve-test --record`).
TestSlip slip_in(const std::filesystem::path& folder, const json& planned_at) {
  std::ifstream stream(folder / "test" / "test.json", std::ios::binary);
  const json found = json::parse(stream, nullptr, false);
  TestSlip slip;
  if (!found.is_object() || found.value("planned_at", json()) != planned_at) return slip;
  const auto text = [&](const char* key) {
    const json value = found.value(key, json());
    return value.is_string() ? value.get<std::string>() : std::string();
  };
  if (!found.value("done", false)) {
    slip.state = found.value("expired", false) ? TestSlip::State::expired : TestSlip::State::open;
    slip.another_move = text("another_move");
    return slip;
  }
  slip.state = TestSlip::State::done;
  slip.competing = text("competing");
  slip.decided = text("decided");
  slip.predicted = found.value("predicted", json::object()).value("probability_right", 0.0);
  slip.probability = found.value("probability", 0.0);
  return slip;
}

}  // namespace

std::string to_text(const TestSlip& slip) {
  switch (slip.state) {
    case TestSlip::State::done:
      return slip.decided.empty() ? "done: not decided"
                                  : fmt::format("done: decided {} with probability {:.2f}",
                                                slip.decided, slip.probability);
    case TestSlip::State::expired: return "expired: the move was not seen in time";
    case TestSlip::State::open: break;
  }
  return "open: the move was not seen yet";
}

Explanation read_explanation(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "explanation.json";
  try {
    std::ifstream stream(file, std::ios::binary);
    if (!stream) throw std::runtime_error("missing or unreadable");
    const json j = json::parse(stream);
    Explanation e;
    e.alarm = kind_of(j.at("alarm"));
    if (!j.at("final_name").is_null()) e.final_name = kind_of(j.at("final_name"));
    e.raised_ms = j.at("raised_ms").get<std::int64_t>();
    e.ended_ms = j.at("ended_ms").get<std::int64_t>();
    e.verdict = j.at("verdict").get<std::string>();
    e.gap_closed = number_of(j.at("gap_closed"));
    e.agrees = j.at("agrees").get<bool>();
    e.since_s = -number_of(j.at("from_s"));
    e.sentence = j.at("sentence").get<std::string>();
    if (const json& first = j.at("first"); !first.is_null()) {
      e.effect = first.at("name").get<std::string>();
      e.block = block_of(first.value("block", ""));
      e.effect_number = first.at("number").get<std::uint16_t>();
      e.size_percent = number_of(first.at("size_percent"));
      e.low_percent = number_of(first.at("low_percent"));
      e.high_percent = number_of(first.at("high_percent"));
      e.confidence = first.at("confidence").get<double>();
      e.alternatives = first.at("alternatives").get<std::vector<std::string>>();
      e.remedy = first.at("remedy").get<std::string>();
    }
    // Absent in files of earlier versions.
    if (const json test = j.value("next_test", json()); !test.is_null()) {
      e.next_test = test.at("text").get<std::string>();
      if (test.contains("valid_until_ms")) e.slip = slip_in(folder, test.at("planned_at"));
    }
    if (e.agrees) e.stick = stick_of(j.at("effects"));
    e.folder = folder;
    return e;
  } catch (const std::exception& e) {
    throw std::runtime_error(fmt::format("{}: {}", file.string(), e.what()));
  }
}

void write_not_explained(const Explanation& e) {
  const json text = {{"alarm", alarm::to_text(e.alarm)},
                     {"final_name", nullptr},
                     {"raised_ms", e.raised_ms},
                     {"ended_ms", e.ended_ms},
                     {"verdict", kNotExplained},
                     {"effects", json::array()},
                     {"gap_closed", nullptr},
                     {"agrees", false},
                     {"from_s", nullptr},
                     {"sentence", e.sentence},
                     {"next_test", nullptr},
                     {"first", nullptr}};
  replace_text(e.folder / "explanation.json",
               text.dump(2, ' ', false, json::error_handler_t::replace) + "\n");
}

void replace_text(const std::filesystem::path& file, const std::string& text) {
  const std::optional<base::FileError> error = base::replace_file(file, text, {.mode = 0666});
  if (error) {
    throw std::runtime_error(
        fmt::format("{}: can't be written: {}", file.string(), base::error_text(error->error)));
  }
}

}  // namespace loopwarden::daemon
