// SPDX-License-Identifier: Apache-2.0
#include "workbench/survey/costs.hpp"

#include <fmt/format.h>

#include <utility>

#include "config/document.hpp"
#include "config/map_reader.hpp"
#include "workbench/files/command_error.hpp"

namespace loopwarden::workbench {
namespace {

using config::MapReader;

void set_range(MapReader& in, const char* key, const config::NumberRule& rule, Range& range) {
  const auto read = in.maybe_range(key, rule);
  if (read.given && read.valid) range = read.value;
}

Costs read_costs(MapReader& in) {
  Costs costs;
  costs.currency = in.text("currency", "of all amounts, for people", costs.currency);
  in.set_number("hours_per_year",
                {.unit = "h", .range = config::between(1.0, 8784.0), .meaning = "of operation"},
                costs.hours_per_year);
  in.maybe_section("loss",
                   "cost per year of a PV that swings by 1 % of its span (RMS), as [least, most]",
                   [&](MapReader& kinds) {
                     for (KindCost& kind : costs.kinds)
                       set_range(kinds, kind.kind, {.range = config::at_least(0.0)}, kind.loss);
                   });
  in.maybe_section("valve", "wear by travel", [&](MapReader& valve) {
    valve.set_number("overhaul", {.range = config::at_least(0.0), .meaning = "cost of an overhaul"},
                     costs.overhaul);
    set_range(valve, "strokes",
              {.range = config::above(0.0), .meaning = "full strokes between two overhauls"},
              costs.strokes);
  });
  in.maybe_section("work", "orders by kind", [&](MapReader& works) {
    for (WorkCost& work : costs.works) {
      works.maybe_section(work.key, work.action, [&](MapReader& order) {
        work.who = order.text("who", "who carries it out", work.who);
        order.set_flag("shutdown", "the loop must be out of service", work.shutdown);
        order.set_number("minutes", {.unit = "min", .range = config::at_least(0.0)}, work.minutes);
        set_range(order, "removes",
                  {.range = config::between(0.0, 1.0), .meaning = "share of the loss"},
                  work.removes);
      });
    }
  });
  return costs;
}

}  // namespace

Range Costs::loss_of(std::string_view kind) const {
  for (const KindCost& one : kinds) {
    if (kind == one.kind) return one.loss;
  }
  return kinds.back().loss;
}

config::Loaded<Costs> read_costs_text(const std::string& file, std::string_view text) {
  auto costs = config::load_text<Costs>(file, text, read_costs);
  if (costs) costs->source = file;
  return costs;
}

Costs read_costs_file(const std::filesystem::path& path) {
  auto costs = config::load_file(path, read_costs_text);
  fmt::print(stderr, "{}", config::to_text(costs.diagnostics));
  if (costs) return std::move(*costs);
  std::string known;
  const config::KeyReference reference = describe_costs();
  for (const config::KeyDescription& key : reference.keys()) {
    if (!key.path.starts_with("work.")) known += (known.empty() ? "" : ", ") + key.path;
  }
  throw CommandError(
      kExitConfiguration,
      fmt::format("{}: can't be used. Its keys: {}. docs/reference/worklist.md describes them",
                  path.string(), known));
}

config::KeyReference describe_costs() {
  return config::keys_of([](MapReader& in) { read_costs(in); });
}

}  // namespace loopwarden::workbench
