// SPDX-License-Identifier: Apache-2.0
#include "config/map_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "base/text.hpp"

namespace loopwarden::config {
namespace {

constexpr std::size_t kMostListItems = 10'000;
constexpr std::size_t kLongestText = 200;  // bytes

std::string range_text(const NumberRule& rule, MapReader::Ends ends) {
  const char* const text = ends == MapReader::Ends::rise ? "[low, high]" : "[first, last]";
  return *rule.unit != '\0' ? fmt::format("{}, {}", text, rule.unit) : text;
}

// Returns a description of the present value for a message.
std::string said(const YamlNode& node) {
  return node.kind == YamlNode::Kind::scalar ? fmt::format("'{}'", quotable(node.text))
                                             : to_text(node.kind);
}

template <class T>
Value<T> required(Value<T> value) {
  value.valid = value.valid && value.given;
  return value;
}

std::string list_of(const std::vector<std::string>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " or " : ", ";
    text += names[i];
  }
  return text;
}

}  // namespace

MapReader::MapReader(YamlNode& node, std::string path, Report& report)
    : path_(std::move(path)), report_(&report) {
  node_ = &node;
  node.visited = node.kind == YamlNode::Kind::map;
  if (!node.visited) {
    report.error(node.place, path_,
                 fmt::format("must be a mapping, `key: value` (got {})", to_text(node.kind)));
  }
}

MapReader::MapReader(KeyReference& reference, std::string path, Report& report)
    : reference_(&reference), path_(std::move(path)), report_(&report) {}

const YamlNode* MapReader::at(std::string_view key) const noexcept {
  return node_ != nullptr ? node_->find(key) : nullptr;
}

Place MapReader::place() const noexcept { return node_ != nullptr ? node_->place : Place{}; }

Place MapReader::place(std::string_view key) const noexcept {
  const YamlNode* node = at(key);
  return node != nullptr ? node->place : place();
}

std::string MapReader::path(std::string_view key) const {
  return path_.empty() ? std::string(key) : fmt::format("{}.{}", path_, key);
}

bool MapReader::given(std::string_view key) const noexcept { return at(key) != nullptr; }

YamlNode::Kind MapReader::kind(std::string_view key) const noexcept {
  const YamlNode* node = at(key);
  return node != nullptr ? node->kind : YamlNode::Kind::nothing;
}

std::string_view MapReader::word(std::string_view key) const noexcept {
  const YamlNode* node = at(key);
  const bool is_word = node != nullptr && node->kind == YamlNode::Kind::scalar && !node->quoted;
  return is_word ? std::string_view(node->text) : std::string_view();
}

void MapReader::error(std::string_view key, std::string message) {
  report_->error(place(key), path(key), std::move(message));
}

void MapReader::error(std::string message) { report_->error(place(), path_, std::move(message)); }

void MapReader::warning(std::string_view key, std::string message) {
  report_->warning(place(key), path(key), std::move(message));
}

void MapReader::note(std::string_view key, std::string message) {
  report_->note(place(key), path(key), std::move(message));
}

YamlNode* MapReader::find(std::string_view key, std::string value_text, Presence presence,
                          std::string fallback, const char* meaning) {
  if (reference_ != nullptr) {
    reference_->add({path(key), std::move(value_text),
                     presence == Presence::required ? "required" : std::move(fallback), meaning});
    return nullptr;
  }
  if (node_->kind != YamlNode::Kind::map) return nullptr;  // already reported
  std::vector<std::string>& known = node_->known_keys;
  if (std::find(known.begin(), known.end(), key) == known.end()) known.emplace_back(key);
  YamlNode* node = node_->find(key);
  if (node == nullptr && presence == Presence::required) {
    const std::string within = path_.empty() ? "" : fmt::format(" in '{}'", path_);
    report_->error(place(), "", fmt::format("missing key '{}'{} ({})", key, within, value_text));
  }
  return node;
}

template <class T>
Value<T> MapReader::start(std::string_view key, const YamlNode* node, T fallback) const {
  Value<T> value;
  value.value = std::move(fallback);
  value.place = node != nullptr ? node->place : place();
  value.key = path(key);
  value.given = node != nullptr;
  value.valid = node == nullptr;
  return value;
}

// --- numbers ---------------------------------------------------------------------------------

Value<double> MapReader::read_number(std::string_view key, YamlNode* node, const NumberRule& rule,
                                     double fallback) {
  Value<double> result = start(key, node, fallback);
  if (node == nullptr) return result;
  std::string fault = fault_of_number(*node, rule);
  if (fault.empty()) {
    const double value = parse_decimal(node->text);
    if (!std::isfinite(value)) {
      fault = fmt::format("is beyond what a number can hold (got {})", quotable(node->text));
    } else if (!rule.range.contains(value)) {
      fault = fmt::format("must be {} (got {})", with_unit(rule.range, rule.unit),
                          quotable(node->text));
    } else {
      result.value = value;
      result.valid = true;
      return result;
    }
  }
  report_->error(node->place, result.key, std::move(fault));
  return result;
}

Value<double> MapReader::need_number(std::string_view key, const NumberRule& rule) {
  return required(
      read_number(key, find(key, to_text(rule), Presence::required, "", rule.meaning), rule, 0.0));
}

Value<double> MapReader::number(std::string_view key, const NumberRule& rule, double fallback) {
  const std::string fallback_text =
      *rule.fallback != '\0' ? rule.fallback : with_unit(fallback, rule.unit);
  return read_number(key, find(key, to_text(rule), Presence::optional, fallback_text, rule.meaning),
                     rule, fallback);
}

Value<double> MapReader::maybe_number(std::string_view key, const NumberRule& rule) {
  return read_number(key, find(key, to_text(rule), Presence::optional, rule.fallback, rule.meaning),
                     rule, 0.0);
}

Value<std::int64_t> MapReader::read_integer(std::string_view key, YamlNode* node,
                                            const IntegerRule& rule, std::int64_t fallback) {
  Value<std::int64_t> result = start(key, node, fallback);
  if (node == nullptr) return result;
  std::string_view digits = node->text;
  const bool hexadecimal = rule.hexadecimal && !node->quoted && is_hexadecimal(digits);
  std::string fault = hexadecimal ? "" : fault_of_number(*node, {.unit = rule.unit});
  if (fault.empty()) {
    if (hexadecimal) digits.remove_prefix(2);
    if (digits.starts_with('+')) digits.remove_prefix(1);
    const char* end = digits.data() + digits.size();
    const auto parsed = std::from_chars(digits.data(), end, result.value, hexadecimal ? 16 : 10);
    if (parsed.ec == std::errc() && parsed.ptr == end && result.value >= rule.low &&
        result.value <= rule.high) {
      result.valid = true;
      return result;
    }
    result.value = fallback;
    fault = fmt::format("must be a whole number from {} to {}{}{} (got {})", rule.low, rule.high,
                        *rule.unit != '\0' ? " " : "", rule.unit, quotable(node->text));
  }
  if (rule.advice != nullptr && node->kind == YamlNode::Kind::scalar) {
    const std::string advice = rule.advice(node->text);
    if (!advice.empty()) fault += fmt::format(". {}", advice);
  }
  report_->error(node->place, result.key, std::move(fault));
  return result;
}

Value<std::int64_t> MapReader::need_integer(std::string_view key, const IntegerRule& rule) {
  return required(read_integer(key, find(key, to_text(rule), Presence::required, "", rule.meaning),
                               rule, rule.low));
}

Value<std::int64_t> MapReader::integer(std::string_view key, const IntegerRule& rule,
                                       std::int64_t fallback) {
  const std::string fallback_text = *rule.fallback != '\0' ? std::string(rule.fallback)
                                    : *rule.unit != '\0' ? fmt::format("{} {}", fallback, rule.unit)
                                                         : fmt::format("{}", fallback);
  return read_integer(key,
                      find(key, to_text(rule), Presence::optional, fallback_text, rule.meaning),
                      rule, fallback);
}

Value<std::int64_t> MapReader::maybe_integer(std::string_view key, const IntegerRule& rule) {
  return read_integer(key,
                      find(key, to_text(rule), Presence::optional, rule.fallback, rule.meaning),
                      rule, rule.low);
}

Value<std::pair<double, double>> MapReader::read_range(std::string_view key, YamlNode* node,
                                                       const NumberRule& rule, Ends ends) {
  Value<std::pair<double, double>> result = start(key, node, std::pair{0.0, 0.0});
  if (node == nullptr) return result;
  if (node->kind != YamlNode::Kind::list || node->values.size() != 2) {
    report_->error(node->place, result.key, fmt::format("must be {}", range_text(rule, ends)));
    return result;
  }
  const Value<double> low = read_number(key, &node->values[0], rule, 0.0);
  const Value<double> high = read_number(key, &node->values[1], rule, 0.0);
  result.value = {low.value, high.value};
  const bool fits = ends == Ends::rise ? low.value < high.value : low.value != high.value;
  result.valid = low.valid && high.valid && fits;
  if (low.valid && high.valid && !fits) {
    report_->error(node->place, result.key,
                   fmt::format("must be {} (got [{}, {}])",
                               ends == Ends::rise ? "[low, high] with low below high"
                                                  : "[first, last], two different numbers",
                               brief(low), brief(high)));
  }
  return result;
}

Value<std::pair<double, double>> MapReader::need_range(std::string_view key,
                                                       const NumberRule& rule) {
  return required(
      read_range(key, find(key, range_text(rule, Ends::rise), Presence::required, "", rule.meaning),
                 rule, Ends::rise));
}

Value<std::pair<double, double>> MapReader::maybe_range(std::string_view key,
                                                        const NumberRule& rule, Ends ends) {
  return read_range(
      key, find(key, range_text(rule, ends), Presence::optional, rule.fallback, rule.meaning), rule,
      ends);
}

template <class T, class Read>
Value<std::vector<T>> MapReader::read_list(std::string_view key, std::string value_text,
                                           const char* meaning, Read read) {
  YamlNode* node = find(key, std::move(value_text), Presence::optional, "", meaning);
  Value<std::vector<T>> result = start(key, node, std::vector<T>{});
  if (node == nullptr || !is_of_kind(key, *node, YamlNode::Kind::list)) return result;
  result.valid = true;
  for (YamlNode& item : node->values) result.valid = read(item, result.value) && result.valid;
  return result;
}

bool MapReader::read_item(std::string_view key, YamlNode& node, std::vector<double>& values) {
  const Value<double> read = read_number(key, &node, {}, 0.0);
  values.push_back(read);
  return read.valid;
}

Value<std::vector<std::pair<double, double>>> MapReader::maybe_points(std::string_view key,
                                                                      const char* value_text,
                                                                      const char* meaning) {
  using Point = std::pair<double, double>;
  return read_list<Point>(
      key, value_text, meaning, [&](YamlNode& point, std::vector<Point>& points) {
        if (point.kind != YamlNode::Kind::list || point.values.size() != 2) {
          report_->error(point.place, path(key), fmt::format("must be {}", value_text));
          return false;
        }
        const Value<double> x = read_number(key, &point.values[0], {}, 0.0);
        const Value<double> y = read_number(key, &point.values[1], {}, 0.0);
        points.emplace_back(x, y);
        return x.valid && y.valid;
      });
}

Value<std::vector<double>> MapReader::maybe_numbers(std::string_view key, const char* unit,
                                                    const char* meaning) {
  return read_list<double>(
      key, fmt::format("[a, b, ...]{}{}", *unit != '\0' ? ", " : "", unit), meaning,
      [&](YamlNode& item, std::vector<double>& values) { return read_item(key, item, values); });
}

Value<std::vector<std::vector<double>>> MapReader::maybe_table(std::string_view key,
                                                               const char* unit,
                                                               const char* meaning) {
  using Row = std::vector<double>;
  return read_list<Row>(key, fmt::format("[[a, b, ...], ...]{}{}", *unit != '\0' ? ", " : "", unit),
                        meaning, [&](YamlNode& row, std::vector<Row>& rows) {
                          rows.emplace_back();
                          bool valid = is_of_kind(key, row, YamlNode::Kind::list);
                          if (!valid) return false;
                          for (YamlNode& item : row.values)
                            valid = read_item(key, item, rows.back()) && valid;
                          return valid;
                        });
}

// --- text and words --------------------------------------------------------------------------

Value<std::string> MapReader::read_text(std::string_view key, YamlNode* node,
                                        std::string fallback) {
  Value<std::string> result = start(key, node, std::move(fallback));
  if (node == nullptr || !is_of_kind(key, *node, YamlNode::Kind::scalar)) return result;
  const auto is_control = [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7F; };
  if (node->text.empty() || node->text.size() > kLongestText ||
      std::any_of(node->text.begin(), node->text.end(), is_control)) {
    report_->error(node->place, result.key,
                   fmt::format("must be one line of 1 to {} bytes (got '{}')", kLongestText,
                               quotable(node->text)));
    return result;
  }
  result.value = node->text;
  result.valid = true;
  return result;
}

Value<std::string> MapReader::need_text(std::string_view key, const char* meaning) {
  return required(read_text(key, find(key, "text", Presence::required, "", meaning), ""));
}

Value<std::string> MapReader::text(std::string_view key, const char* meaning,
                                   std::string fallback) {
  YamlNode* node = find(key, "text", Presence::optional, fallback, meaning);
  return read_text(key, node, std::move(fallback));
}

Value<bool> MapReader::flag(std::string_view key, const char* meaning, bool fallback) {
  YamlNode* node =
      find(key, "true or false", Presence::optional, fallback ? "true" : "false", meaning);
  Value<bool> result = start(key, node, fallback);
  if (node == nullptr) return result;
  const std::string_view text = word(key);
  result.valid = text == "true" || text == "false";
  if (result.valid) {
    result.value = text == "true";
  } else {
    report_->error(node->place, result.key,
                   fmt::format("must be true or false (got {})", said(*node)));
  }
  return result;
}

Value<std::size_t> MapReader::choose(std::string_view key, const std::vector<std::string>& names,
                                     Presence presence, std::size_t fallback, const char* meaning,
                                     const WordRule& rule) {
  const std::string expected = list_of(names);
  YamlNode* node = find(key, expected, presence,
                        *rule.fallback == '\0' ? names[fallback] : rule.fallback, meaning);
  Value<std::size_t> result = start(key, node, fallback);
  result.valid = node == nullptr && (presence == Presence::optional || describing());
  if (node == nullptr) return result;
  const std::string lower = base::lower_case(node->text);
  std::string written = rule.any_case ? lower : node->text;
  // Short forms that operators and the command line use. No other word has these spellings.
  if (lower == "auto") written = "automatic";
  if (lower == "man") written = "manual";
  const auto found = std::find(names.begin(), names.end(), written);
  if (node->kind == YamlNode::Kind::scalar && found != names.end()) {
    result.value = static_cast<std::size_t>(found - names.begin());
    result.valid = true;
    return result;
  }
  const auto other = std::find_if(rule.others.begin(), rule.others.end(),
                                  [&](const OtherWord& word) { return lower == word.written; });
  const std::string meant = other != rule.others.end()
                                ? fmt::format("; did you mean '{}'?", other->meant)
                                : suggestion(node->text, names);
  report_->error(node->place, result.key,
                 fmt::format("must be {} (got {}){}", expected, said(*node), meant));
  return result;
}

Value<std::string> MapReader::need_word(std::string_view key, const std::vector<std::string>& words,
                                        const char* meaning) {
  const Value<std::size_t> chosen = choose(key, words, Presence::required, 0, meaning, {});
  return {words[chosen.value], chosen.place, chosen.key, chosen.given, chosen.valid};
}

Value<std::string> MapReader::word_of(std::string_view key, const std::vector<std::string>& words,
                                      const char* meaning) {
  const Value<std::size_t> chosen = choose(key, words, Presence::optional, 0, meaning, {});
  return {words[chosen.value], chosen.place, chosen.key, chosen.given, chosen.valid};
}

Value<std::vector<std::string>> MapReader::maybe_words(std::string_view key,
                                                       const std::vector<std::string>& words,
                                                       const char* meaning) {
  using Texts = std::vector<std::string>;
  return read_list<std::string>(
      key, fmt::format("[{}, ...]", list_of(words)), meaning,
      [&](const YamlNode& item, Texts& texts) {
        const auto holds = [&](const Texts& all) {
          return std::find(all.begin(), all.end(), item.text) != all.end();
        };
        const bool known = item.kind == YamlNode::Kind::scalar && holds(words);
        const bool right = known && !holds(texts);
        if (right) {
          texts.push_back(item.text);
        } else {
          report_->error(item.place, path(key),
                         known ? fmt::format("has '{}' twice", quotable(item.text))
                               : fmt::format("must hold {} (got '{}'){}", list_of(words),
                                             quotable(item.text), suggestion(item.text, words)));
        }
        return right;
      });
}

Value<std::vector<std::string>> MapReader::maybe_texts(std::string_view key, const char* meaning,
                                                       const char* form) {
  return read_list<std::string>(
      key, form, meaning, [&](const YamlNode& item, std::vector<std::string>& texts) {
        const bool right = item.kind == YamlNode::Kind::scalar;
        if (right) {
          texts.push_back(item.text);
        } else {
          report_->error(item.place, path(key),
                         fmt::format("must hold texts (got {})", to_text(item.kind)));
        }
        return right;
      });
}

// --- mappings and lists ----------------------------------------------------------------------

bool MapReader::is_of_kind(std::string_view key, const YamlNode& node, YamlNode::Kind wanted) {
  if (node.kind == wanted) return true;
  report_->error(node.place, path(key),
                 fmt::format("must be {} (got {})", to_text(wanted), said(node)));
  return false;
}

std::optional<MapReader> MapReader::section(std::string_view key, Presence presence,
                                            const char* meaning) {
  YamlNode* node = find(key, "mapping", presence, "none", meaning);
  if (reference_ != nullptr) return MapReader(*reference_, path(key), *report_);
  if (node == nullptr || !is_of_kind(key, *node, YamlNode::Kind::map)) return std::nullopt;
  return MapReader(*node, path(key), *report_);
}

std::optional<MapReader> MapReader::need_section(std::string_view key, const char* meaning) {
  return section(key, Presence::required, meaning);
}

std::optional<MapReader> MapReader::maybe_section(std::string_view key, const char* meaning) {
  return section(key, Presence::optional, meaning);
}

std::vector<MapReader> MapReader::maybe_list(std::string_view key, const char* meaning) {
  YamlNode* node = find(key, "list of mappings", Presence::optional, "none", meaning);
  std::vector<MapReader> items;
  if (reference_ != nullptr)
    items.push_back(MapReader(*reference_, fmt::format("{}[]", path(key)), *report_));
  if (node == nullptr || !is_of_kind(key, *node, YamlNode::Kind::list)) return items;
  if (node->values.size() > kMostListItems) {
    error(key, fmt::format("must not have more than {} items", kMostListItems));
    return items;
  }
  for (std::size_t i = 0; i < node->values.size(); ++i) {
    const std::string item_path = fmt::format("{}[{}]", path(key), i);
    items.push_back(MapReader(node->values[i], item_path, *report_));
  }
  return items;
}

std::vector<std::pair<std::string, MapReader>> MapReader::maybe_named_sections(
    std::string_view key, const char* name, const char* meaning) {
  YamlNode* node = find(key, "mapping of names to mappings", Presence::optional, "none", meaning);
  std::vector<std::pair<std::string, MapReader>> sections;
  if (reference_ != nullptr) {
    const std::string section_path = fmt::format("{}.<{}>", path(key), name);
    sections.emplace_back(name, MapReader(*reference_, section_path, *report_));
  }
  if (node == nullptr || !is_of_kind(key, *node, YamlNode::Kind::map)) return sections;
  for (std::size_t i = 0; i < node->keys.size(); ++i) {
    const std::string& section_name = node->keys[i].text;
    const std::string section_path = fmt::format("{}.{}", path(key), quotable(section_name));
    sections.emplace_back(section_name, MapReader(node->values[i], section_path, *report_));
  }
  return sections;
}

MapReader MapReader::variant(std::string_view name) const {
  MapReader same(*this);
  if (describing()) same.path_ += fmt::format(" ({})", name);
  return same;
}

void MapReader::ignore_rest() {
  if (node_ == nullptr) return;
  node_->visited = false;
  // A required key that is missing may be present in a misspelt form.
  for (const YamlNode& key : node_->keys) {
    const std::vector<std::string>& known = node_->known_keys;
    const bool is_known = std::find(known.begin(), known.end(), key.text) != known.end();
    const std::string meant = is_known ? std::string() : suggestion(key.text, known);
    if (meant.empty()) continue;
    report_->error(key.place, "", fmt::format("unknown key '{}'{}", quotable(key.text), meant));
  }
}

void MapReader::close() {
  if (node_ != nullptr) report_unknown_keys(*node_, *report_);
}

bool MapReader::declare(std::string_view key, std::string value_text, Presence presence,
                        std::string fallback, const char* meaning) {
  return find(key, std::move(value_text), presence, std::move(fallback), meaning) != nullptr;
}

}  // namespace loopwarden::config
