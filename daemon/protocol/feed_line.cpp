// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/feed_line.hpp"

#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/protocol/requests.hpp"

namespace loopwarden::protocol {
namespace {

using nlohmann::json;

constexpr std::size_t kLongestId = 64;
constexpr std::size_t kLongestName = 1024;
constexpr const char* kStart = R"({"values":[)";
constexpr const char* kEnd = "]}";

// Returns the number at `key`, or nullopt if it is null or absent.
std::optional<double> number_at(const json& object, const char* key,
                                const char* expected = "a number") {
  const auto found = object.find(key);
  if (found == object.end() || found->is_null()) return std::nullopt;
  if (!found->is_number())
    throw RequestError(std::string(key) + " must be " + expected + " or null");
  const double value = found->get<double>();
  if (!std::isfinite(value))
    throw RequestError(std::string(key) + " is beyond what a number holds");
  return value;
}

FedValue::Quality quality_of(const json& object) {
  const auto found = object.find("quality");
  if (found == object.end()) return FedValue::Quality::good;
  if (*found == "good") return FedValue::Quality::good;
  if (*found == "uncertain") return FedValue::Quality::uncertain;
  if (*found == "bad") return FedValue::Quality::bad;
  throw RequestError("quality must be good, uncertain or bad");
}

// Returns the reason of a bad value. An unknown reason, as from a newer feeder, counts as the
// source's own.
FedValue::Reason reason_of(const json& object) {
  const auto found = object.find("reason");
  if (found == object.end()) return FedValue::Reason::source;
  if (*found == "timeout") return FedValue::Reason::timeout;
  if (*found == "death") return FedValue::Reason::death;
  return *found == "link" ? FedValue::Reason::link : FedValue::Reason::source;
}

FedValue value_of(const json& object) {
  if (!object.is_object()) throw RequestError("each of values must be an object");
  FedValue fed;
  const auto name = object.find("name");
  if (name == object.end() || !name->is_string()) throw RequestError("name must be a text");
  fed.name = name->get<std::string>();
  if (fed.name.empty() || fed.name.size() > kLongestName) {
    throw RequestError("name must have 1 to 1024 bytes");
  }
  const auto value = object.find("value");
  if (value != object.end() && value->is_string()) {
    fed.word = value->get<std::string>();
    if (fed.word.empty() || fed.word.size() > FedValue::kLongestWord) {
      throw RequestError("a word must have 1 to 64 bytes");
    }
  } else {
    fed.value = number_at(object, "value", "a number, a word");
  }
  fed.time_s = number_at(object, "time");
  fed.quality = quality_of(object);
  fed.reason = reason_of(object);
  if (const auto source = object.find("source"); source != object.end() && source->is_string()) {
    fed.source = source->get_ref<const std::string&>().substr(0, FedValue::kLongestSource);
  }
  if (!fed.value && fed.word.empty() && fed.quality != FedValue::Quality::bad) {
    throw RequestError("value may be null with quality bad only");
  }
  return fed;
}

const char* to_text(FedValue::Quality quality) noexcept {
  switch (quality) {
    case FedValue::Quality::good: return "good";
    case FedValue::Quality::uncertain: return "uncertain";
    case FedValue::Quality::bad: break;
  }
  return "bad";
}

const char* to_text(FedValue::Reason reason) noexcept {
  switch (reason) {
    case FedValue::Reason::timeout: return "timeout";
    case FedValue::Reason::death: return "death";
    case FedValue::Reason::link: return "link";
    case FedValue::Reason::source: break;
  }
  return "source";
}

json json_of(const FedValue& fed) {
  json object{{"name", fed.name}, {"value", nullptr}, {"quality", to_text(fed.quality)}};
  if (fed.value) object["value"] = *fed.value;
  if (!fed.word.empty()) object["value"] = fed.word;
  if (fed.time_s) object["time"] = *fed.time_s;
  if (fed.reason != FedValue::Reason::source) object["reason"] = to_text(fed.reason);
  if (!fed.source.empty()) object["source"] = fed.source;
  return object;
}

std::string id_of(const json& object) {
  const auto found = object.find("id");
  if (found == object.end()) return {};
  const bool text = found->is_string() && found->get_ref<const std::string&>().size() <= kLongestId;
  if (!text && !found->is_number()) {
    throw RequestError("id must be a number or a text of at most 64 bytes");
  }
  return found->dump();
}

}  // namespace

FeedLine read_feed_line(std::string_view line, std::string& id) {
  id.clear();
  const json object = json::parse(line, nullptr, false);
  if (!object.is_object()) throw RequestError("a line is a JSON object");
  FeedLine feed{.values = {}, .id = id_of(object)};
  id = feed.id;
  if (const auto feeder = object.find("feeder"); feeder != object.end() && feeder->is_string()) {
    feed.feeder = feeder->get<std::string>();
  }
  const auto values = object.find("values");
  if (values == object.end() || !values->is_array()) throw RequestError("values must be a list");
  feed.values.reserve(values->size());
  for (const json& value : *values) feed.values.push_back(value_of(value));
  return feed;
}

std::vector<std::string> write_feed_lines(const std::vector<FedValue>& values) {
  std::vector<std::string> lines;
  for (const FedValue& fed : values) {
    const std::string one = json_of(fed).dump();
    const bool fits = !lines.empty() && lines.back().size() + one.size() + 3 <= FeedLine::kLongest;
    if (fits) {
      lines.back() += ',';
    } else {
      if (!lines.empty()) lines.back() += kEnd;
      lines.emplace_back(kStart);
    }
    lines.back() += one;
  }
  if (!lines.empty()) lines.back() += kEnd;
  return lines;
}

std::string feed_sign_of_life(const std::string& feeder) {
  if (feeder.empty()) return std::string(kStart) + kEnd;
  return json{{"values", json::array()}, {"feeder", feeder}}.dump();
}

std::string feed_taken(const std::string& id, std::size_t taken) {
  return R"({"id":)" + id + R"(,"ok":true,"taken":)" + std::to_string(taken) + "}";
}

std::string feed_refused(const std::string& id, std::string_view why) {
  return R"({"id":)" + id + R"(,"ok":false,"error":)" + json(why).dump() + "}";
}

}  // namespace loopwarden::protocol
