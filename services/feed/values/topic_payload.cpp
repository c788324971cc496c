// SPDX-License-Identifier: Apache-2.0
#include "services/feed/values/topic_payload.hpp"

#include <date/date.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <regex>

#include "base/text.hpp"

namespace loopwarden::feed {
namespace {

using nlohmann::json;
using protocol::FedValue;

constexpr std::size_t kLongestTime = 40;
constexpr double kLastTime_s = 4'102'444'800.0;  // 2100
constexpr const char* kSpace = " \t\r\n";

std::optional<double> number_in(std::string_view text) {
  const std::size_t from = text.find_first_not_of(kSpace);
  if (from == std::string_view::npos) return std::nullopt;
  text = text.substr(from, text.find_last_not_of(kSpace) + 1 - from);
  double number = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  return whole && std::isfinite(number) ? std::optional(number) : std::nullopt;
}

[[noreturn]] void refuse(const JsonPointer& at, const char* expected) {
  throw BadTopicPayload("expected " + std::string(expected) + " at '" + at.to_string() + "'");
}

// Returns the part that the pointer names.
const json& part(const json& document, const JsonPointer& at, const char* expected) {
  try {
    return document.at(at);
  } catch (const json::exception&) {
    refuse(at, expected);
  }
}

const char* expected_value(bool words) {
  return words ? "a number or a word of at most 64 bytes" : "a number";
}

// Stores a number or a word in `fed`. Returns false if the text is neither.
bool take_text(std::string_view text, bool words, FedValue& fed) {
  fed.value = number_in(text);
  if (fed.value || !words) return fed.value.has_value();
  const std::size_t from = text.find_first_not_of(kSpace);
  if (from == std::string_view::npos) return false;
  fed.word = text.substr(from, text.find_last_not_of(kSpace) + 1 - from);
  return fed.word.size() <= FedValue::kLongestWord && base::is_utf8(fed.word);
}

// Null means "no value".
void take_value(const json& document, const PayloadRule& rule, FedValue& fed) {
  const char* const expected = expected_value(rule.words);
  const json& found = part(document, *rule.value, expected);
  if (found.is_null()) return;
  if (found.is_boolean()) fed.value = found.get<bool>() ? 1.0 : 0.0;
  if (found.is_number()) fed.value = found.get<double>();
  const bool right = found.is_string()
                         ? take_text(found.get_ref<const std::string&>(), rule.words, fed)
                         : fed.value && std::isfinite(*fed.value);
  if (!right) refuse(*rule.value, expected);
}

double time_at(const json& document, const JsonPointer& at, TimeForm form) {
  const char* const expected = form == TimeForm::iso  ? "a time of ISO 8601 with Z or an offset"
                               : form == TimeForm::ms ? "ms since 1970"
                                                      : "s since 1970";
  const json& found = part(document, at, expected);
  std::optional<double> time_s;
  if (form == TimeForm::iso) {
    if (found.is_string()) time_s = parse_iso_time(found.get_ref<const std::string&>());
  } else if (found.is_number()) {
    time_s = found.get<double>() * (form == TimeForm::ms ? 1e-3 : 1.0);
  }
  if (!time_s || !(*time_s >= 0.0) || *time_s >= kLastTime_s) refuse(at, expected);
  return *time_s;
}

FedValue::Quality quality_at(const json& document, const JsonPointer& at, QualityCodes codes) {
  constexpr const char* kExpected = "good, uncertain, bad, true, false or a code";
  const json& found = part(document, at, kExpected);
  if (found.is_boolean()) {
    return found.get<bool>() ? FedValue::Quality::good : FedValue::Quality::bad;
  }
  if (found.is_number()) return quality_of_code(found.get<double>(), codes);
  if (!found.is_string()) refuse(at, kExpected);
  const std::string word = base::lower_case(found.get_ref<const std::string&>());
  if (word == "good") return FedValue::Quality::good;
  if (word == "uncertain") return FedValue::Quality::uncertain;
  if (word != "bad") refuse(at, kExpected);
  return FedValue::Quality::bad;
}

}  // namespace

std::optional<double> parse_iso_time(const std::string& text) {
  static const std::regex kForm(
      R"((\d{4})-(\d\d)-(\d\d)T(\d\d):(\d\d):(\d\d(?:\.\d+)?)(?:Z|([+-])(\d\d):?(\d\d)))");
  std::smatch found;
  if (text.size() > kLongestTime || !std::regex_match(text, found, kForm)) return std::nullopt;
  const auto number = [&](std::size_t part) { return std::stoi(found[part].str()); };
  const date::year_month_day day{date::year{number(1)},
                                 date::month{static_cast<unsigned>(number(2))},
                                 date::day{static_cast<unsigned>(number(3))}};
  const int hour = number(4);
  const int minute = number(5);
  const std::optional<double> second = number_in(found[6].str());
  constexpr double kMinute_s = 60.0;
  if (!day.ok() || hour > 23 || minute > 59 || !second || *second >= kMinute_s) return std::nullopt;
  int behind_min = 60 * hour + minute;
  if (found[7].matched) {
    if (number(8) > 23 || number(9) > 59) return std::nullopt;
    const int offset_min = 60 * number(8) + number(9);
    behind_min += found[7].str() == "+" ? -offset_min : offset_min;
  }
  const std::chrono::seconds midnight = date::sys_days(day).time_since_epoch();
  return static_cast<double>(midnight.count()) + kMinute_s * behind_min + *second;
}

FedValue read_topic_payload(const PayloadRule& rule, const std::string& name,
                            std::string_view payload) {
  if (payload.size() > kMostTopicBytes) throw BadTopicPayload("longer than 1 MiB");
  FedValue fed{.name = name};
  if (!rule.value) {
    if (!take_text(payload, rule.words, fed)) {
      throw BadTopicPayload("expected " + std::string(expected_value(rule.words)));
    }
    return fed;
  }
  const json document = json::parse(payload, nullptr, false);
  if (document.is_discarded()) throw BadTopicPayload("expected JSON");
  take_value(document, rule, fed);
  if (rule.time) fed.time_s = time_at(document, *rule.time, rule.time_form);
  if (rule.quality) fed.quality = quality_at(document, *rule.quality, rule.quality_codes);
  if (!fed.value && fed.word.empty()) fed.quality = FedValue::Quality::bad;
  return fed;
}

}  // namespace loopwarden::feed
