// SPDX-License-Identifier: Apache-2.0
#include "config/watched_io_reader.hpp"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "config/modbus_reader.hpp"

namespace loopwarden::config {
namespace {

enum class Backend { modbus, feed };
constexpr auto kBackends =
    std::to_array<Choice<Backend>>({{"modbus", Backend::modbus}, {"feed", Backend::feed}});

// Reads FEEDER:NAME with a feeder of loopwardend.yaml.
hal::feed::FeedName read_name(MapReader& in, const IoContext& context) {
  const Value<std::string> text = in.need_text(
      "feed", "FEEDER:NAME, a feeder of loopwardend.yaml and the name it gives the value");
  hal::feed::FeedName name;
  if (!text.given || !text.valid) return name;
  const std::size_t colon = text.value.find(':');
  if (colon == std::string::npos || colon == 0 || colon + 1 == text.value.size()) {
    in.error("feed", fmt::format("must be FEEDER:NAME, such as opcua:FIC205.PV (got '{}')",
                                 quotable(text.value)));
    return name;
  }
  name = {text.value.substr(0, colon), text.value.substr(colon + 1)};
  if (context.feeders == nullptr || context.feeders->contains(name.feeder)) return name;
  std::vector<std::string> names;
  for (const auto& [known, user] : *context.feeders) names.push_back(known);
  in.error("feed", fmt::format("no feeder '{}' in loopwardend.yaml{}", quotable(name.feeder),
                               suggestion(name.feeder, names)));
  return name;
}

void read_feed(MapReader in, const IoContext& context, IoSection& section) {
  hal::feed::FeedSettings settings;
  const auto read = [&](MapReader& value, hal::feed::FeedPoint& point) {
    point.name = read_name(value, context);
    const Value<double> scale =
        value.number("scale", {"", any_number(), "value = fed * scale + offset; not 0"}, 1.0);
    if (scale.valid && scale == 0.0) value.error("scale", "must not be 0");
    point.scale = scale;
    point.offset = value.number("offset", {"", any_number(), "see scale"}, 0.0);
  };
  in.need_section("pv", kWatchedPv, [&](MapReader& pv) { read(pv, settings.process_variable); });
  in.need_section("co", kWatchedCo, [&](MapReader& co) { read(co, settings.output); });
  in.maybe_section("sp", kWatchedSp,
                   [&](MapReader& sp) { read(sp, settings.set_point.emplace()); });
  in.maybe_section("stem", kWatchedStem,
                   [&](MapReader& stem) { read(stem, settings.stem.emplace()); });
  in.maybe_section("mode", kWatchedMode, [&](MapReader& mode) {
    settings.mode = read_name(mode, context);
    settings.mode_values = read_mode_values(mode, ModeForm::numbers_and_words);
  });
  section.io = std::move(settings);
}

}  // namespace

hal::ModeValues read_mode_values(MapReader& mode, ModeForm form) {
  const bool words = form == ModeForm::numbers_and_words;
  // By value, so that a duplicate is reported as it is written.
  std::map<double, std::string> said;
  const auto read = [&](const char* key, const char* meaning) {
    std::vector<double> values;
    const Value<std::vector<std::string>> list =
        mode.maybe_texts(key, meaning, words ? "[number or word, ...]" : "[number, ...]");
    for (const std::string& text : list.value) {
      const double number = hal::number_of_word(text);
      const bool is_word = std::abs(number) > hal::kLargestNumber;
      const bool right = is_word ? words && !text.empty() && text.size() <= hal::kLongestWord
                                 : number == std::round(number);
      if (!right) {
        mode.error(key, fmt::format("must be whole numbers{} (got '{}')",
                                    words ? " or words of at most 64 bytes" : "", quotable(text)));
        continue;
      }
      values.push_back(number);
      said.emplace(values.back(), text);
    }
    return std::pair(values, list.place);
  };
  const auto [automatic, place] =
      read("automatic", "its values in which the loop is closed: automatic, cascade, ...");
  const auto manual = read("manual", "its values in manual; any other is a third mode").first;
  hal::ModeValues values{.automatic = automatic, .manual = manual};
  if (mode.describing()) return values;
  if (!mode.given("automatic")) {
    mode.error(fmt::format(
        "missing key 'automatic' (list of {}: windows are evaluated in these modes only)",
        words ? "numbers or words" : "numbers"));
  }
  for (const double value : values.manual) {
    if (hal::holds(values.automatic, value)) {
      mode.error("manual", fmt::format("{} is in automatic (at {}) as well",
                                       quotable(said.at(value)), to_text(place)));
    }
  }
  return values;
}

IoSection read_watched_io(MapReader& in, const IoContext& context) {
  IoSection section;
  section.command = in.place();
  const Value<Backend> backend =
      in.need_one_of("backend", kBackends, "source of the values; it is never written");
  section.known = backend.valid && backend.given;
  if (!section.known && !in.describing()) {
    in.ignore_rest();
    return section;
  }
  const auto chosen = [&](Backend which) { return in.describing() || backend == which; };
  if (chosen(Backend::modbus)) read_modbus_source(in.variant("modbus"), context, section);
  if (chosen(Backend::feed)) read_feed(in.variant("feed"), context, section);
  return section;
}

}  // namespace loopwarden::config
