// SPDX-License-Identifier: Apache-2.0
#include "record/import/units.hpp"

#include <array>
#include <string>
#include <utility>

#include "base/text.hpp"
#include "record/import/number_text.hpp"

namespace loopwarden::record {
namespace {

// Units in lower case between bars. Alternative spellings are replaced first, see kWritings.
constexpr std::string_view kUnits =
    "|%|%open|%rh|%o2|% open|% rh|pct|percent|prozent|v|mv|kv|ma|a|ua|ka|w|kw|mw|gw|hp|va|kva|mva|"
    "var|kvar|mvar|wh|kwh|mwh|j|kj|mj|gj|btu|mbtu|mmbtu|cal|kcal|hz|khz|mhz|ohm|kohm|s|sec|secs|ms|"
    "us|ns|min|h|hr|hrs|d|bar|bara|barg|bar(a)|bar(g)|mbar|ubar|pa|hpa|kpa|mpa|kpag|kpaa|mpag|mpaa|"
    "psi|psia|psig|psid|atm|torr|mtorr|ata|ate|mmhg|inhg|cmhg|mmh2o|cmh2o|inh2o|fth2o|mh2o|mmwc|"
    "inwc|mmws|mws|mwc|iwc|kg|g|mg|ug|t|lb|lbs|klb|ton|tons|oz|m|mm|cm|dm|km|um|nm|in|ft|yd|mil|"
    "m2|cm2|mm2|ft2|in2|m3|nm3|sm3|cm3|dm3|ft3|in3|bbl|gal|l|ml|cl|dl|hl|ul|gpm|gph|gpd|lpm|lph|"
    "slpm|"
    "nlpm|sccm|slm|nlm|cfm|scfm|acfm|icfm|cfh|scfh|mscfh|mmscfd|scfd|bpd|bph|mgd|mld|pph|kpph|tph|"
    "cms|rpm|u/min|upm|rps|rad|deg|grad|ph|ppm|ppb|mol|kmol|mmol|us/cm|ms/"
    "cm|ntu|fnu|db|dba|lx|lm|cp|"
    "cst|mpas|mpa.s|n|kn|nm|knm|pcs|counts|cts|c|f|k|r|degc|degf|degk|degr|deg c|deg f|celsius|"
    "fahrenheit|kelvin|grad c|\u00b0|\u00b0c|\u00b0f|\u00b0k|\u00b0 c|\u00b0 f|\u2103|\u2109|";
constexpr std::string_view kPer =
    "|s|sec|min|h|hr|std|hour|d|day|m|m2|m3|nm3|cm|cm2|mm2|in2|ft2|ft3|l|kg|mol|yr|a|k|";
constexpr std::array<std::pair<std::string_view, std::string_view>, 8> kWritings{
    {{"\u00b2", "2"},
     {"\u00b3", "3"},
     {"\u00b5", "u"},
     {"\u03bc", "u"},
     {"\u00ba", "\u00b0"},  // the ordinal sign of Spanish keyboards
     {"\u00a0", " "},
     {"\u202f", " "},
     {"\u00b7", "."}}};
constexpr std::string_view kNoUnit =
    "|no engunits|no eng units|no unit|no units|none|unitless|dimensionless|engunits|eng units|";
constexpr std::size_t kLongest = 24;  // bytes
constexpr std::size_t kMostBlanks = 3;

bool holds(std::string_view list, const std::string& word) {
  return word.find('|') == word.npos && list.find('|' + word + '|') != list.npos;
}

// Returns the text in lower case, with one spelling for each sign.
std::string plain(std::string_view text) {
  std::string word = base::lower_case(base::trimmed(text));
  for (const auto& [from, to] : kWritings) {
    for (std::size_t at = word.find(from); at != word.npos; at = word.find(from, at + to.size()))
      word.replace(at, from.size(), to);
  }
  return std::string(base::trimmed(word));
}

}  // namespace

bool is_unit(std::string_view text) {
  if (text.empty() || text.size() > kLongest) return false;
  const std::string word = plain(text);
  if (word.empty() || holds(kUnits, word)) return !word.empty();
  // Accepts a quotient of units: kg/s, Nm3/h, %/s, g/m3.
  const std::size_t slash = word.find('/');
  if (slash == word.npos || slash == 0 || word.size() > 14) return false;
  const bool starts_with_digit = word.front() >= '0' && word.front() <= '9';
  return !starts_with_digit && holds(kPer, std::string(base::trimmed(word.substr(slash + 1))));
}

WithUnit split_cell(std::string_view cell) {
  const std::size_t end = number_end(cell);
  if (end == 0 || end >= cell.size() || !is_unit(cell.substr(end))) return {cell, {}};
  std::string_view number = cell.substr(0, end);
  while (!number.empty() && !(number.back() >= '0' && number.back() <= '9') &&
         number.back() != '.' && number.back() != ',')
    number.remove_suffix(1);
  std::string_view unit = base::trimmed(cell.substr(number.size()));
  for (const std::string_view blank : {"\u00a0", "\u202f", "\u2009"}) {
    if (unit.starts_with(blank)) unit = base::trimmed(unit.substr(blank.size()));
  }
  return {number, unit};
}

WithUnit split_name(std::string_view name) {
  // Finds the longest text after a blank that is a unit: "deg C" before "C".
  std::size_t blank = name.size();
  std::size_t at = name.npos;
  for (std::size_t k = 0; k < kMostBlanks && blank > 0; ++k) {
    blank = name.find_last_of(' ', blank - 1);
    if (blank == name.npos || blank == 0) break;
    const std::string_view unit = name.substr(blank + 1);
    if (is_unit(unit) || holds(kNoUnit, plain(unit))) at = blank;
  }
  if (at == name.npos) return {name, {}};
  const std::string_view unit = name.substr(at + 1);
  std::string_view before = base::trimmed(name.substr(0, at));
  while (!before.empty() && std::string_view(",;-/").find(before.back()) != before.npos)
    before = base::trimmed(before.substr(0, before.size() - 1));
  if (before.ends_with(" in")) before = base::trimmed(before.substr(0, before.size() - 3));
  return {before, is_unit(unit) ? unit : std::string_view()};
}

}  // namespace loopwarden::record
