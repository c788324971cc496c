// SPDX-License-Identifier: Apache-2.0
// loopwarden effects: the catalogue of effects, as text, JSON, or documents with pictures.
#include "workbench/commands/effects.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <span>
#include <vector>

#include "model/plant/effect_catalogue.hpp"
#include "workbench/text/effect_guide.hpp"
#include "workbench/report/effect_picture.hpp"
#include "workbench/text/json_number.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

constexpr const char* kControllerBlocks = "controller";
constexpr const char* kPictureFolder = "pictures/effects";

struct EffectsOptions {
  bool json = false;
  std::string out;
};

struct ParameterRow {
  const char* name;
  const char* unit;
  std::string value;     // range
  std::string fallback;  // "required", or what holds without it
  const char* meaning;
};

// One effect as all three outputs show it. The controller's mismatch is no effect of a plant and so
// not in the catalogue of the model.
struct EffectEntry {
  const char* name;
  std::string blocks;
  const char* meaning;
  const char* header;
  std::span<const plant::ParameterInfo> parameters;
  std::span<const plant::OptionInfo> options;
};

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr plant::ParameterInfo kControllerParameters[] = {
    {"kp", "CO units/PV unit", -kInfinity, true, kInfinity, true, true, 0.0,
     "proportional gain found in the record"},
    {"ki", "CO units/(PV unit s)", -kInfinity, true, kInfinity, true, true, 0.0,
     "integral gain found in the record"}};

std::vector<EffectEntry> entries() {
  std::vector<EffectEntry> result;
  for (const plant::EffectInfo& info : plant::effect_catalogue()) {
    std::string blocks;
    for (const plant::Block block : info.blocks) {
      blocks += fmt::format("{}{}", blocks.empty() ? "" : " or ", plant::to_text(block));
    }
    result.push_back({info.name, blocks, info.meaning, info.header, info.parameters, info.options});
  }
  result.push_back({"controller_mismatch",
                    kControllerBlocks,
                    "the controller's settings are others than believed",
                    "",
                    kControllerParameters,
                    {}});
  return result;
}

std::string range_text(const plant::ParameterInfo& p) {
  std::string text;
  if (std::isfinite(p.low)) text = fmt::format("{} {:g}", p.low_is_open ? ">" : ">=", p.low);
  if (std::isfinite(p.high)) {
    text +=
        fmt::format("{}{} {:g}", text.empty() ? "" : " and ", p.high_is_open ? "<" : "<=", p.high);
  }
  return text.empty() ? "any" : text;
}

std::string fallback_text(const plant::ParameterInfo& p) {
  if (p.required) return "required";
  return std::isfinite(p.fallback) ? fmt::format("{:g}", p.fallback) : "none";
}

std::vector<ParameterRow> rows_of(const EffectEntry& entry) {
  std::vector<ParameterRow> rows;
  for (const plant::ParameterInfo& p : entry.parameters) {
    rows.push_back({p.name, p.unit, range_text(p), fallback_text(p), p.meaning});
  }
  for (const plant::OptionInfo& option : entry.options) {
    std::string values;
    for (const char* value : option.values) {
      values += fmt::format("{}{}", values.empty() ? "" : ", ", value);
    }
    rows.push_back({option.name, "", values, option.values.front(), option.meaning});
  }
  return rows;
}

std::vector<EffectExample> examples_of(const char* name) {
  std::vector<EffectExample> result;
  for (EffectExample& example : effect_examples()) {
    if (example.spec.name == name) result.push_back(std::move(example));
  }
  return result;
}

void print_text() {
  for (const EffectEntry& entry : entries()) {
    fmt::print("{} ({}): {}\n", entry.name, entry.blocks, entry.meaning);
    for (const ParameterRow& row : rows_of(entry)) {
      fmt::print("  {:<18} {}{}{}, {}: {}\n", row.name, row.value, *row.unit != '\0' ? " " : "",
                 row.unit, row.fallback == "required" ? row.fallback : "default " + row.fallback,
                 row.meaning);
    }
    if (const EffectGuide* guide = find_guide(entry.name)) {
      fmt::print("  {}\n", guide->seen);
      for (const LookAlike& other : guide->look_alikes) {
        fmt::print("  - {}: {}\n", other.name, other.tell);
      }
    }
    fmt::print("\n");
  }
}

json as_json() {
  json result = json::array();
  for (const EffectEntry& entry : entries()) {
    json parameters = json::array();
    for (const plant::ParameterInfo& p : entry.parameters) {
      parameters.push_back({{"name", p.name},
                            {"unit", p.unit},
                            {"low", finite_or_null(p.low)},
                            {"low_is_open", p.low_is_open},
                            {"high", finite_or_null(p.high)},
                            {"high_is_open", p.high_is_open},
                            {"required", p.required},
                            {"default", p.required ? json(nullptr) : finite_or_null(p.fallback)},
                            {"meaning", p.meaning}});
    }
    json options = json::array();
    for (const plant::OptionInfo& option : entry.options) {
      json values = json::array();
      for (const char* value : option.values) values.push_back(value);
      options.push_back(
          {{"name", option.name}, {"values", std::move(values)}, {"meaning", option.meaning}});
    }
    json look_alikes = json::array();
    const EffectGuide* guide = find_guide(entry.name);
    if (guide != nullptr) {
      for (const LookAlike& other : guide->look_alikes) {
        look_alikes.push_back({{"name", other.name}, {"tell", other.tell}});
      }
    }
    result.push_back({{"name", entry.name},
                      {"block", entry.blocks},
                      {"meaning", entry.meaning},
                      {"parameters", std::move(parameters)},
                      {"options", std::move(options)},
                      {"seen", guide != nullptr ? guide->seen : ""},
                      {"look_alikes", std::move(look_alikes)}});
  }
  return result;
}

int run_effects(const EffectsOptions& options) {
  if (!options.out.empty()) {
    const std::filesystem::path out = options.out;
    OutputFiles files;
    files.make_folder(out / kPictureFolder);
    for (const EffectExample& example : effect_examples()) {
      files.add(out / kPictureFolder / (example.file + ".svg"), effect_picture_svg(example));
    }
    files.add(out / "effects.md", effects_markdown());
    files.commit();
  }
  if (options.json) {
    fmt::print("{}\n", as_json().dump(2));
  } else {
    print_text();
  }
  return kExitOk;
}

}  // namespace

std::string effects_markdown() {
  std::string text =
      "# Effects\n\n"
      "<!-- Generated: `loopwarden effects --out docs` renews it and its pictures. -->\n\n"
      "What a loop may have that its model lacks. `loopwarden gap` looks for them, model files "
      "and\n"
      "simulations take them, and `loopwarden effects` prints this list (`--json` for "
      "programs).\n\n"
      "Each picture is the same loop twice: flow plant 1 (gain 1.2264, time constant 1.69 s, dead\n"
      "time 2.63 s, PI with kp 0.3494 and ki 0.04 1/s, 0-10 V and 0-10 L/min) without noise, with "
      "the\neffect (blue) and without it (orange, dashed), stepping through the same set points. "
      "The\nresidual is what is left of PV when a model without the effect is driven by the CO of "
      "the\nloop with it: what a record shows of the effect.\n\n"
      "| effect | block | |\n|---|---|---|\n";
  for (const EffectEntry& entry : entries()) {
    text += fmt::format("| [`{0}`](#{0}) | {1} | {2} |\n", entry.name, entry.blocks, entry.meaning);
  }
  for (const EffectEntry& entry : entries()) {
    std::string meaning = entry.meaning;
    meaning.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(meaning.front())));
    text += fmt::format("\n## {}\n\n{}. Block: {}.", entry.name, meaning, entry.blocks);
    if (*entry.header != '\0') {
      text += fmt::format(" Equation and source: [`{0}`](../model/plant/{0}).", entry.header);
    }
    text += "\n\n| parameter | value | default | meaning |\n|---|---|---|---|\n";
    for (const ParameterRow& row : rows_of(entry)) {
      text += fmt::format("| `{}` | {}{}{} | {} | {} |\n", row.name, row.value,
                          *row.unit != '\0' ? " " : "", row.unit, row.fallback, row.meaning);
    }
    for (const EffectExample& example : examples_of(entry.name)) {
      text +=
          fmt::format("\n![{}]({}/{}.svg)\n", example_text(example), kPictureFolder, example.file);
    }
    const EffectGuide* guide = find_guide(entry.name);
    if (guide == nullptr) continue;
    text += fmt::format("\n{}\n", guide->seen);
    if (guide->look_alikes.empty()) continue;
    text += "\nLook-alikes:\n\n";
    for (const LookAlike& other : guide->look_alikes) {
      const bool is_effect = find_guide(other.name) != nullptr;
      text += is_effect ? fmt::format("- [`{0}`](#{0}): {1}\n", other.name, other.tell)
                        : fmt::format("- {}: {}\n", other.name, other.tell);
    }
  }
  return text;
}

void add_effects(CLI::App& app, int& exit_code) {
  const auto options = std::make_shared<EffectsOptions>();
  CLI::App* sub = app.add_subcommand(
      "effects", "the catalogue of effects: parameters, signatures, look-alikes");
  sub->add_option("--out", options->out,
                  "folder for effects.md and a picture of each effect's signature");
  sub->add_flag("--json", options->json, "print the catalogue as JSON");
  sub->footer("Example: loopwarden effects --out docs");
  sub->callback([options, &exit_code] { exit_code = run_effects(*options); });
}

}  // namespace loopwarden::workbench
