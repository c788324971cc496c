// SPDX-License-Identifier: Apache-2.0
// loopwarden effects: prints the catalogue of effects as text, JSON, or documents with pictures.
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/effects.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "model/effects/catalogue.hpp"
#include "workbench/report/effect_picture.hpp"
#include "workbench/text/json_number.hpp"
#include "workbench/files/output_files.hpp"
#include "workbench/commands/subcommands.hpp"

namespace loopwarden::workbench {
namespace {

using nlohmann::json;

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

std::string blocks_of(const effects::Descriptor& effect) {
  std::string blocks;
  for (const effects::Block block : effect.blocks) {
    blocks += fmt::format("{}{}", blocks.empty() ? "" : " or ", effects::to_text(block));
  }
  return blocks;
}

std::string range_text(const effects::ParameterInfo& p) {
  std::string text;
  if (std::isfinite(p.low)) text = fmt::format("{} {:g}", p.low_is_open ? ">" : ">=", p.low);
  if (std::isfinite(p.high)) {
    text +=
        fmt::format("{}{} {:g}", text.empty() ? "" : " and ", p.high_is_open ? "<" : "<=", p.high);
  }
  return text.empty() ? "any" : text;
}

std::string fallback_text(const effects::ParameterInfo& p) {
  if (p.required) return "required";
  if (p.as_process_lag) return "the process's";
  return std::isfinite(p.fallback) ? fmt::format("{:g}", p.fallback) : "none";
}

std::vector<ParameterRow> rows_of(const effects::Descriptor& entry) {
  std::vector<ParameterRow> rows;
  for (const effects::ParameterInfo& p : entry.parameters) {
    rows.push_back({p.name, p.unit, range_text(p), fallback_text(p), p.meaning});
  }
  for (const effects::OptionInfo& option : entry.options) {
    std::string values;
    for (const char* value : option.values) {
      values += fmt::format("{}{}", values.empty() ? "" : ", ", value);
    }
    rows.push_back({option.name, "", values, option.values.front(), option.meaning});
  }
  if ((entry.takes_table && entry.options.empty()) || entry.is_learned) {
    rows.push_back({"table", "", entry.table.form, entry.is_learned ? "by form" : "required",
                    entry.table.meaning});
  }
  return rows;
}

void print_text() {
  for (const effects::Descriptor& entry : effects::vocabulary()) {
    fmt::print("{} ({}): {}\n", entry.name, blocks_of(entry), entry.meaning);
    for (const ParameterRow& row : rows_of(entry)) {
      fmt::print("  {:<18} {}{}{}, {}: {}\n", row.name, row.value, *row.unit != '\0' ? " " : "",
                 row.unit, row.fallback == "required" ? row.fallback : "default " + row.fallback,
                 row.meaning);
    }
    fmt::print("  {}\n  Action: {}\n", entry.seen, entry.remedy);
    for (const effects::LookAlike& other : entry.look_alikes) {
      fmt::print("  - {}: {}\n", other.name, other.tell);
    }
    fmt::print("\n");
  }
}

json as_json() {
  json result = json::array();
  for (const effects::Descriptor& entry : effects::vocabulary()) {
    json parameters = json::array();
    for (const effects::ParameterInfo& p : entry.parameters) {
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
    for (const effects::OptionInfo& option : entry.options) {
      json values = json::array();
      for (const char* value : option.values) values.push_back(value);
      options.push_back(
          {{"name", option.name}, {"values", std::move(values)}, {"meaning", option.meaning}});
    }
    json look_alikes = json::array();
    for (const effects::LookAlike& other : entry.look_alikes) {
      look_alikes.push_back({{"name", other.name}, {"tell", other.tell}});
    }
    result.push_back({{"name", entry.name},
                      {"block", blocks_of(entry)},
                      {"meaning", entry.meaning},
                      {"parameters", std::move(parameters)},
                      {"options", std::move(options)},
                      {"seen", entry.seen},
                      {"remedy", entry.remedy},
                      {"look_alikes", std::move(look_alikes)}});
  }
  return result;
}

int run_effects(const EffectsOptions& options) {
  if (!options.out.empty()) {
    const std::filesystem::path out = options.out;
    OutputFiles files;
    files.make_folder(out / kPictureFolder);
    for (const effects::Example& example : effect_examples()) {
      files.add(out / kPictureFolder / (std::string(example.file) + ".svg"),
                effect_picture_svg(example));
    }
    files.add(out / "effects.md", effects_markdown());
    files.commit();
  }
  options.json ? show_json(as_json()) : print_text();
  return kExitOk;
}

}  // namespace

std::string effects_markdown() {
  std::string text =
      "# Effects\n\n"
      "<!-- Generated: `loopwarden effects --out docs/reference` renews it and its pictures. "
      "-->\n\n"
      "Effects that a loop may have and its model lacks. `loopwarden gap` finds them, model files "
      "and\n"
      "simulations take them, and `loopwarden effects` prints this list (`--json` for "
      "programs).\n\n"
      "Each picture is the same loop twice: flow plant 1 (gain 1.2264, time constant 1.69 s, dead\n"
      "time 2.63 s, PI with kp 0.3494 and ki 0.04 1/s, 0-10 V and 0-10 L/min) without noise, with "
      "the\neffect (blue) and without it (orange, dashed), stepping through the same set points. "
      "The\nresidual is what is left of PV when a model without the effect is driven by the CO of "
      "the\nloop with it: what a record shows of the effect.\n\n"
      "The register `explanation_effect` holds the number of an effect.\n\n"
      "| number | effect | block | |\n|---|---|---|---|\n";
  for (const effects::Descriptor& entry : effects::vocabulary()) {
    text += fmt::format("| {0} | [`{1}`](#{1}) | {2} | {3} |\n", entry.number, entry.name,
                        blocks_of(entry), entry.meaning);
  }
  for (const effects::Descriptor& entry : effects::vocabulary()) {
    std::string meaning = entry.meaning;
    meaning.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(meaning.front())));
    text += fmt::format("\n## {}\n\n{}. Block: {}.", entry.name, meaning, blocks_of(entry));
    if (*entry.header != '\0') {
      text += fmt::format(" Equation and source: [`{0}`](../../model/effects/{0}).", entry.header);
    }
    text += "\n\n| parameter | value | default | meaning |\n|---|---|---|---|\n";
    for (const ParameterRow& row : rows_of(entry)) {
      text += fmt::format("| `{}` | {}{}{} | {} | {} |\n", row.name, row.value,
                          *row.unit != '\0' ? " " : "", row.unit, row.fallback, row.meaning);
    }
    for (const effects::Example& example : entry.examples) {
      text +=
          fmt::format("\n![{}]({}/{}.svg)\n", example_text(example), kPictureFolder, example.file);
    }
    text += fmt::format("\n{}\n\nAction: {}\n", entry.seen, entry.remedy);
    if (entry.look_alikes.empty()) continue;
    text += "\nLook-alikes:\n\n";
    for (const effects::LookAlike& other : entry.look_alikes) {
      const bool is_effect = effects::find_word(other.name) != nullptr;
      text += is_effect ? fmt::format("- [`{0}`](#{0}): {1}\n", other.name, other.tell)
                        : fmt::format("- {}: {}\n", other.name, other.tell);
    }
  }
  return text;
}

void add_effects(Program& program) {
  auto [command, o] = program.command(
      "effects", "Print the catalogue of effects: parameters, signatures, look-alikes",
      run_effects);
  command.option("--out", o.out, "folder for effects.md and a picture of each effect's signature");
  command.flag("--json", o.json, "print the catalogue as JSON");
  command.footer("Example: loopwarden effects --out docs/reference");
}

}  // namespace loopwarden::workbench
