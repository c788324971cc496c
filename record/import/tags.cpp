// SPDX-License-Identifier: Apache-2.0
#include "record/import/tags.hpp"

#include <algorithm>
#include <unordered_map>

#include "record/import/number_text.hpp"
#include "base/text.hpp"

namespace loopwarden::record {
namespace {

struct Word {
  std::string_view text;  // lower case, without spaces, '_' and '-'
  Role role;
};
// What control systems call them: ISA, Honeywell (OP), Yokogawa (SV, MV), Emerson (OUT), Siemens (LMN), Rockwell (CV).
constexpr std::array kWords{
    Word{"pv", Role::pv},
    Word{"processvalue", Role::pv},
    Word{"processvariable", Role::pv},
    Word{"meas", Role::pv},
    Word{"measurement", Role::pv},
    Word{"measuredvalue", Role::pv},
    Word{"pvin", Role::pv},
    Word{"actualvalue", Role::pv},
    Word{"sp", Role::sp},
    Word{"spt", Role::sp},
    Word{"sv", Role::sp},
    Word{"setpoint", Role::sp},
    Word{"setvalue", Role::sp},
    Word{"spwrk", Role::sp},
    Word{"spint", Role::sp},
    Word{"wsp", Role::sp},
    Word{"csp", Role::sp},
    Word{"op", Role::co},
    Word{"out", Role::co},
    Word{"output", Role::co},
    Word{"mv", Role::co},
    Word{"co", Role::co},
    Word{"cv", Role::co},
    Word{"lmn", Role::co},
    Word{"controlleroutput", Role::co},
    Word{"manipulatedvariable", Role::co},
    Word{"manipulatedvalue", Role::co},
    Word{"controloutput", Role::co},
    Word{"stem", Role::stem},
    Word{"stemtravel", Role::stem},
    Word{"travel", Role::stem},
    Word{"position", Role::stem},
    Word{"valveposition", Role::stem},
    Word{"zt", Role::stem},
    Word{"zi", Role::stem},
    Word{"readback", Role::stem},
    Word{"mode", Role::mode},
    Word{"modeactual", Role::mode},
    Word{"actualmode", Role::mode},
    Word{"modeact", Role::mode},
    Word{"mode.actual", Role::mode},
    Word{"auto", Role::mode},
    Word{"automan", Role::mode},
    Word{"a/m", Role::mode},
};
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
  for (const Word& known : kWords) {
    if (word == known.text) return known.role;
  }
  return std::nullopt;
}

// What stands around the name on an OPC or a PI server.
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

// FIC101/PID1/PV.CV: what is read of a parameter, behind its name.
std::string_view without_field(std::string_view name) {
  for (const std::string_view field : {".CV", ".F_CV", ".Value", ".value", ".VALUE", ".Val"}) {
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

bool is_unit(std::string_view text) {
  constexpr std::array<std::string_view, 44> kUnits{"%",
                                                    "%open",
                                                    "pct",
                                                    "percent",
                                                    "v",
                                                    "mv",
                                                    "ma",
                                                    "a",
                                                    "s",
                                                    "sec",
                                                    "ms",
                                                    "min",
                                                    "h",
                                                    "bar",
                                                    "barg",
                                                    "mbar",
                                                    "kpa",
                                                    "mpa",
                                                    "pa",
                                                    "psi",
                                                    "psig",
                                                    "kg",
                                                    "t",
                                                    "m",
                                                    "mm",
                                                    "cm",
                                                    "l",
                                                    "gpm",
                                                    "lpm",
                                                    "scfm",
                                                    "rpm",
                                                    "hz",
                                                    "kw",
                                                    "mw",
                                                    "ph",
                                                    "ppm",
                                                    "c",
                                                    "f",
                                                    "k",
                                                    "degc",
                                                    "degf",
                                                    "deg c",
                                                    "\xC2\xB0"
                                                    "c",
                                                    "\xC2\xB0"
                                                    "f"};
  const std::string word = base::lower_case(base::trimmed(text));
  if (std::find(kUnits.begin(), kUnits.end(), word) != kUnits.end()) return true;
  // A quotient of them: m3/h, kg/s, l/min, Nm3/h, %/s.
  const std::size_t slash = word.find('/');
  if (slash == std::string::npos || slash == 0 || word.size() > 12) return false;
  constexpr std::array<std::string_view, 9> kPer{"s",    "sec", "min", "h", "hr",
                                                 "hour", "d",   "day", "m3"};
  return std::find(kPer.begin(), kPer.end(), word.substr(slash + 1)) != kPer.end();
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
  // The longest ending that is a role: "FIC101 Process Value" before "Value".
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

std::vector<LoopSignals> find_loops(const std::vector<std::string>& names) {
  std::vector<LoopSignals> loops;
  std::unordered_map<std::string, std::size_t> known;
  for (const std::string& name : names) {
    const TagName tag = read_tag(name);
    if (!tag.role) continue;
    const auto [at, is_new] = known.try_emplace(tag.loop, loops.size());
    if (is_new) loops.push_back({.tag = tag.loop, .names = {}, .units = {}});
    LoopSignals& loop = loops[at->second];
    if (loop.has(*tag.role)) continue;
    loop.names[index_of(*tag.role)] = name;
    loop.units[index_of(*tag.role)] = tag.unit;
  }
  return loops;
}

}  // namespace loopwarden::record
