// SPDX-License-Identifier: Apache-2.0
#include "record/import/tags.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "record/import/units.hpp"
#include "record/record_csv.hpp"
#include "base/text.hpp"

namespace loopwarden::record {
namespace {

struct RoleWords {
  Role role;
  std::string_view words;  // lower case, without '_' and '-', each between spaces
};
// Names of the signals in control systems: ISA, Honeywell (OP), Yokogawa (SV, MV), Emerson (OUT),
// Siemens (LMN), Rockwell (CV).
constexpr std::array kRoleWords{
    RoleWords{Role::pv,
              " pv processvalue processvariable meas measurement measuredvalue"
              " pvin actualvalue "},
    RoleWords{Role::sp, " sp spt sv setpoint setvalue spwrk spint wsp csp "},
    RoleWords{Role::co,
              " op out output mv co cv lmn controlleroutput manipulatedvariable"
              " manipulatedvalue controloutput "},
    RoleWords{Role::stem, " stem stemtravel travel position valveposition zt zi readback "},
    RoleWords{Role::mode, " mode modeactual actualmode modeact mode.actual auto automan a/m "},
};
// Returns whether `list` contains the word between two of `mark`.
bool holds(std::string_view list, char mark, const std::string& word) {
  return word.find(mark) == std::string::npos && list.find(mark + word + mark) != list.npos;
}

constexpr std::string_view kSeparators = "./\\_:|- ";

std::string packed(std::string_view text) {
  std::string word;
  for (const char c : base::lower_case(text)) {
    if (c != ' ' && c != '_' && c != '-') word += c;
  }
  return word;
}

std::optional<Role> role_of(std::string_view text) {
  const std::string word = packed(text);
  for (const RoleWords& known : kRoleWords) {
    if (holds(known.words, ' ', word)) return known.role;
  }
  return std::nullopt;
}

// Returns the name without the parts that an OPC or a PI server adds.
std::string_view without_address(std::string_view name) {
  if (name.starts_with("ns=") || name.starts_with("nsu=")) {
    const std::size_t id = name.find(";s=");
    if (id != std::string_view::npos) name.remove_prefix(id + 3);
  }
  if (name.starts_with("\\\\")) {
    const std::size_t server = name.find('\\', 2);
    if (server != std::string_view::npos) name.remove_prefix(server + 1);
  }
  return name;
}

constexpr std::array<std::string_view, 6> kFields{".CV",    ".F_CV",  ".Value",
                                                  ".value", ".VALUE", ".Val"};

// Returns the name without its field, which names an attribute of a parameter: FIC101/PID1/PV.CV.
std::string_view without_field(std::string_view name) {
  for (const std::string_view field : kFields) {
    if (name.size() <= field.size() || !name.ends_with(field)) continue;
    const std::string_view rest = name.substr(0, name.size() - field.size());
    const std::size_t cut = rest.find_last_of("./\\_:");
    if (role_of(cut == std::string_view::npos ? rest : rest.substr(cut + 1))) return rest;
  }
  return name;
}

std::string_view without_separators(std::string_view text) {
  while (!text.empty() && kSeparators.find(text.back()) != std::string_view::npos)
    text.remove_suffix(1);
  return text;
}

}  // namespace

const char* to_text(Role role) noexcept {
  constexpr std::array<const char*, kRoles> kNames{"pv", "sp", "co", "stem", "mode"};
  return kNames[index_of(role)];
}

std::optional<Role> role_from_text(std::string_view text) noexcept {
  for (std::size_t k = 0; k < kRoles; ++k) {
    if (text == to_text(static_cast<Role>(k))) return static_cast<Role>(k);
  }
  return std::nullopt;
}

TagName read_tag(std::string_view name) {
  TagName tag;
  name = base::trimmed(name);
  if (!name.empty() && (name.back() == ')' || name.back() == ']')) {
    const std::size_t open = name.rfind(name.back() == ')' ? '(' : '[');
    if (open != std::string_view::npos && open > 0) {
      tag.unit = std::string(base::trimmed(name.substr(open + 1, name.size() - open - 2)));
      name = base::trimmed(name.substr(0, open));
    }
  }
  name = without_field(without_address(name));
  if ((tag.role = role_of(name))) return tag;
  if (const WithUnit split = split_name(name); split.text.size() < name.size()) {
    TagName without = read_tag(split.text);
    if (without.role) {
      if (without.unit.empty()) without.unit = std::string(split.unit);
      return without;
    }
  }
  // Finds the longest ending that is a role: "FIC101 Process Value" before "Value".
  for (std::size_t cut = 1; cut + 1 < name.size(); ++cut) {
    if (kSeparators.find(name[cut]) == std::string_view::npos) continue;
    const std::optional<Role> role = role_of(name.substr(cut + 1));
    if (!role) continue;
    tag.role = role;
    tag.loop = std::string(without_separators(name.substr(0, cut)));
    return tag;
  }
  tag.loop = std::string(name);
  return tag;
}

bool InstrumentName::is_transmitter() const noexcept {
  return function == "T" || function == "IT" || function == "I";
}

bool InstrumentName::is_valve() const noexcept { return function == "V" || function == "CV"; }

bool InstrumentName::is_controller() const noexcept {
  return function == "C" || function == "IC" || function == "RC";
}

std::optional<InstrumentName> instrument_name(std::string_view name) {
  for (const std::string_view field : kFields) {
    if (name.ends_with(field)) name.remove_suffix(field.size());
  }
  const auto is_upper = [&](std::size_t k) { return name[k] >= 'A' && name[k] <= 'Z'; };
  std::size_t last = name.size();
  while (last-- > 1 && !(is_upper(last) && is_upper(last - 1))) {
  }
  if (last == 0 || last >= name.size()) return std::nullopt;
  const std::size_t number = name.find_first_not_of("-_ .", last + 1);
  if (number == std::string_view::npos || name[number] < '0' || name[number] > '9')
    return std::nullopt;
  std::size_t first = last;
  while (first > 0 && is_upper(first - 1)) --first;
  return InstrumentName{.before = name.substr(0, first),
                        .measured = name[first],
                        .function = name.substr(first + 1, last - first),
                        .number = name.substr(last + 1)};
}

double ModeWords::read(std::string_view text) const {
  const std::string word = base::lower_case(base::trimmed(text));
  const auto has = [&](const std::vector<std::string>& words) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (has(automatic) || has(cascade)) return 1.0;
  return has(manual) ? 0.0 : parse_mode(text);
}

std::string fingerprint(const LoopSignals& signals) {
  std::string text = signals.tag + "|" + signals.kind;
  for (std::size_t role = 0; role < kRoles; ++role) {
    text += "|" + signals.names[role] + "|" + signals.units[role];
    if (const auto& range = signals.ranges[role])
      text += fmt::format("|{} {}", range->first, range->second);
  }
  if (const ModeWords* words = signals.mode_words.get()) {
    for (const auto* list : {&words->automatic, &words->manual, &words->cascade})
      text += fmt::format("|{}", fmt::join(*list, ","));
  }
  return text;
}

}  // namespace loopwarden::record
