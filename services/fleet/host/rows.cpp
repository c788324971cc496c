// SPDX-License-Identifier: Apache-2.0
#include "services/fleet/host/rows.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

#include "base/text.hpp"
#include "model/alarm/alarm.hpp"

namespace loopwarden::fleet {
namespace {

using sparkplug::Metric;
using sparkplug::number_of;

constexpr std::string_view kAlarm = "alarm/";
constexpr std::string_view kExplanation = "explanation/";
constexpr std::string_view kFile = "file/";
// Prefix in order/result: "request/evidence NAME: refused: WHY"
constexpr std::string_view kRequest = "request/evidence ";
constexpr std::string_view kRefused = ": refused: ";
// Valid times: 2000 to 2100. A time outside is no error of a clock: it is not a time.
constexpr std::uint64_t kFirstTime = 946'684'800'000;
constexpr std::uint64_t kLastTime = 4'102'444'800'000;

std::string bounded(const std::string& text) { return std::string(base::cut(text, kLongestText)); }

// Returns whether the alarm's `since` is the time at which it was raised. In the normal state it is
// not: the alarm may have been normal for long.
bool was_raised(const std::string& state) {
  using alarm::AlarmState;
  return state != alarm::to_text(AlarmState::normal) &&
         state != alarm::to_text(AlarmState::shelved) &&
         state != alarm::to_text(AlarmState::suppressed);
}

std::optional<std::string> state_of(const sparkplug::Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return bounded(*text);
  const std::optional<double> code = number_of(value);
  if (!code || *code < 0.0 || *code >= alarm::kAlarmStates) return std::nullopt;
  return alarm::to_text(static_cast<alarm::AlarmState>(*code));
}

nlohmann::json json_of(const sparkplug::Value& value) {
  if (const auto* text = std::get_if<std::string>(&value)) return bounded(*text);
  if (const auto* flag = std::get_if<bool>(&value)) return *flag;
  const std::optional<double> number = number_of(value);
  return number ? nlohmann::json(*number) : nlohmann::json();
}

std::optional<std::string> text_property(const Metric& metric, const char* key) {
  const sparkplug::Property* property = metric.property(key);
  const auto* text = property == nullptr ? nullptr : std::get_if<std::string>(&property->value);
  return text == nullptr ? std::nullopt : std::optional(*text);
}

std::optional<int> count_property(const Metric& metric, const char* key) {
  const sparkplug::Property* property = metric.property(key);
  const std::optional<double> number =
      property == nullptr ? std::nullopt : number_of(property->value);
  return number && *number >= 0.0 && *number <= kMostParts
             ? std::optional(static_cast<int>(*number))
             : std::nullopt;
}

class Reducer {
 public:
  Reducer(const Message& message, const BookPointer& book, Rows& rows)
      : message_(message), book_(book), rows_(rows) {}

  ReduceOutcome run() {
    for (const Metric& metric : message_.payload.metrics) take(metric);
    take_alarms();
    if (!explanation_.empty()) {
      rows_.explanations.push_back({book_, explanation_time_ms_, explanation_.dump()});
    }
    return outcome_;
  }

 private:
  void take(const Metric& metric) {
    const MetricInfo* info = book_->find(metric);
    if (info == nullptr) {
      // Parts of a file have the names of requests, which a birth can't list in advance.
      if (metric.name.starts_with(kFile)) return take_file(metric);
      ++outcome_.unknown_metrics;
      return;
    }
    const std::int64_t time_ms = time_of(metric);
    const sparkplug::Value value = sparkplug::retyped(metric.value, info->type);
    take_value(metric, *info, time_ms, value);
    if (info->name.starts_with(kAlarm)) take_alarm_part(info->name, time_ms, value);
    if (info->name.starts_with(kExplanation)) take_explanation_part(info->name, time_ms, value);
    if (info->name == "order/result") take_refusal(value);
  }

  std::int64_t time_of(const Metric& metric) {
    const std::optional<std::uint64_t> said =
        metric.time_ms ? metric.time_ms : message_.payload.time_ms;
    if (said && *said >= kFirstTime && *said < kLastTime) return static_cast<std::int64_t>(*said);
    ++outcome_.bad_times;
    return message_.received_ms;
  }

  void take_value(const Metric& metric, const MetricInfo& info, std::int64_t time_ms,
                  const sparkplug::Value& value) {
    if (std::holds_alternative<sparkplug::Bytes>(value) ||
        std::holds_alternative<sparkplug::Opaque>(value)) {
      return;
    }
    ValueRow row{.book = book_,
                 .metric = static_cast<std::size_t>(&info - book_->metrics.data()),
                 .time_ms = time_ms,
                 .number = number_of(value),
                 .of_birth = of_birth(),
                 .historical = metric.historical,
                 .transient = metric.transient};
    if (const auto* text = std::get_if<std::string>(&value)) row.text = bounded(*text);
    rows_.values.push_back(std::move(row));
  }

  bool of_birth() const {
    return message_.topic.type == sparkplug::MessageType::nbirth ||
           message_.topic.type == sparkplug::MessageType::dbirth;
  }

  // Handles alarm/NAME/state, /severity and /since.
  void take_alarm_part(const std::string& name, std::int64_t time_ms,
                       const sparkplug::Value& value) {
    const std::size_t slash = name.rfind('/');
    if (slash <= kAlarm.size()) return;
    const std::string_view part = std::string_view(name).substr(slash + 1);
    const std::string alarm = name.substr(kAlarm.size(), slash - kAlarm.size());
    if (part == "severity") severities_[alarm] = number_of(value);
    if (part == "since") {
      const std::optional<double> since = number_of(value);
      if (since && *since >= kFirstTime && *since < kLastTime) {
        since_ms_[alarm] = static_cast<std::int64_t>(*since);
      }
    }
    const std::optional<std::string> state = part == "state" ? state_of(value) : std::nullopt;
    if (state) states_.push_back({book_, alarm, time_ms, *state, std::nullopt});
  }

  void take_explanation_part(const std::string& name, std::int64_t time_ms,
                             const sparkplug::Value& value) {
    const nlohmann::json part = json_of(value);
    // If the loop's alarms were never explained, a birth has all parts, without values.
    if (of_birth() && (part.is_null() || part == "")) return;
    explanation_[name.substr(kExplanation.size())] = part;
    explanation_time_ms_ = std::max(explanation_time_ms_, time_ms);
  }

  void take_refusal(const sparkplug::Value& value) {
    const auto* text = std::get_if<std::string>(&value);
    if (text == nullptr || !text->starts_with(kRequest)) return;
    const std::size_t refused = text->find(kRefused, kRequest.size());
    if (refused == std::string::npos) return;
    rows_.refusals.push_back({book_, text->substr(kRequest.size(), refused - kRequest.size()),
                              bounded(text->substr(refused + kRefused.size()))});
  }

  void take_alarms() {
    for (AlarmRow& row : states_) {
      const auto severity = severities_.find(row.name);
      if (severity != severities_.end()) row.severity = severity->second;
      // The alarm's time is the box's `since`, not the time of the birth or of the check.
      const auto since = since_ms_.find(row.name);
      if (since != since_ms_.end() && since->second < row.time_ms && was_raised(row.state)) {
        AlarmRow raised = row;
        raised.time_ms = since->second;
        raised.state = alarm::to_text(alarm::AlarmState::unacknowledged);
        rows_.alarms.push_back(std::move(raised));
      }
      rows_.alarms.push_back(std::move(row));
    }
  }

  void take_file(const Metric& metric) {
    const auto* bytes = std::get_if<sparkplug::Bytes>(&metric.value);
    const std::optional<int> part = count_property(metric, "part");
    const std::optional<int> parts = count_property(metric, "parts");
    const std::optional<std::string> sha256 = text_property(metric, "sha256");
    if (bytes == nullptr || !part || !parts || !sha256 || *part >= *parts) {
      ++outcome_.unknown_metrics;
      return;
    }
    rows_.file_parts.push_back({book_, bounded(text_property(metric, "request").value_or("")),
                                bounded(text_property(metric, "folder").value_or("")),
                                count_property(metric, "files").value_or(0),
                                bounded(metric.name.substr(kFile.size())), bounded(*sha256), *part,
                                *parts, bytes->data});
  }

  const Message& message_;
  const BookPointer& book_;
  Rows& rows_;
  ReduceOutcome outcome_;
  std::vector<AlarmRow> states_;
  std::map<std::string, std::optional<double>> severities_;
  std::map<std::string, std::int64_t> since_ms_;
  nlohmann::json explanation_ = nlohmann::json::object();
  std::int64_t explanation_time_ms_ = 0;
};

}  // namespace

ReduceOutcome reduce(const Message& message, const BookPointer& book, Rows& rows) {
  return Reducer(message, book, rows).run();
}

}  // namespace loopwarden::fleet
