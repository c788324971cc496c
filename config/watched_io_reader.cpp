// SPDX-License-Identifier: Apache-2.0
#include "config/watched_io_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "config/modbus_reader.hpp"

namespace loopwarden::config {
namespace {

enum class Backend { modbus, feed };
constexpr auto kBackends =
    std::to_array<Choice<Backend>>({{"modbus", Backend::modbus}, {"feed", Backend::feed}});

// NAME:VALUE, of a feeder that loopwardend.yaml knows.
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
  const auto read = [&](MapReader& value, hal::feed::FeedName& name) {
    name = read_name(value, context);
  };
  in.need_section("pv", kWatchedPv, [&](MapReader& pv) { read(pv, settings.process_variable); });
  in.need_section("co", kWatchedCo, [&](MapReader& co) { read(co, settings.output); });
  in.maybe_section("sp", kWatchedSp,
                   [&](MapReader& sp) { read(sp, settings.set_point.emplace()); });
  in.maybe_section("stem", kWatchedStem,
                   [&](MapReader& stem) { read(stem, settings.stem.emplace()); });
  in.maybe_section("mode", kWatchedMode, [&](MapReader& mode) {
    read(mode, settings.mode.emplace());
    settings.mode_values = read_mode_values(mode);
  });
  section.io = std::move(settings);
}

}  // namespace

hal::ModeValues read_mode_values(MapReader& mode) {
  hal::ModeValues values;
  const auto read = [&](const char* key, const char* meaning) {
    Value<std::vector<double>> list = mode.maybe_numbers(key, "", meaning);
    for (const double value : list.value) {
      if (list.valid && value != std::round(value)) {
        mode.error(key, fmt::format("must be whole numbers (got {})", brief(value)));
      }
    }
    return list;
  };
  const auto automatic =
      read("automatic", "its values in which the loop is closed: automatic, cascade, ...");
  const auto manual = read("manual", "its values in manual; any other is a third mode");
  values = {.automatic = automatic, .manual = manual};
  if (mode.describing()) return values;
  if (!mode.given("automatic")) {
    mode.error(
        "missing key 'automatic' (list of numbers: windows are judged in these modes alone)");
  }
  for (const double value : values.manual) {
    if (hal::holds(values.automatic, value)) {
      mode.error("manual", fmt::format("{} stands in automatic (at {}) as well", brief(value),
                                       to_text(automatic.place)));
    }
  }
  return values;
}

IoSection read_watched_io(MapReader& in, const IoContext& context) {
  IoSection section;
  section.command = in.place();
  const Value<Backend> backend =
      in.need_one_of("backend", kBackends, "what delivers the values; nothing is written to it");
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
