// SPDX-License-Identifier: Apache-2.0
#include "daemon/protocol/requests.hpp"

#include <algorithm>
#include <array>
#include <string_view>

#include "daemon/protocol/members.hpp"

namespace loopwarden::protocol {

using nlohmann::json;

namespace {

// Appends the value at a key, as quoted in refusals.
void want_value(const json& value, const char* key, std::string& text) {
  if (!value.is_string()) {
    throw RequestError(std::string("a text is needed for \"") + key + "\"");
  }
  text = value.get<std::string>();
}
void want_value(const json& value, const char* key, double& number) {
  if (!value.is_number()) throw RequestError(std::string(key) + " must be a number");
  number = value.get<double>();
}
void want_value(const json& value, const char* key, std::uint64_t& count) {
  if (!value.is_number_unsigned()) throw RequestError(std::string(key) + " must be a whole number");
  count = value.get<std::uint64_t>();
}
void want_value(const json& value, const char* key, bool& flag) {
  if (!value.is_boolean()) throw RequestError(std::string(key) + " must be true or false");
  flag = value.get<bool>();
}
void want_value(const json& value, const char*, Expected& expected) { value.get_to(expected); }
void want_value(const json& value, const char* key, TestTerms& terms) {
  if (!value.is_object()) throw RequestError(std::string(key) + " is an object");
  value.get_to(terms);
}
void want_value(const json& value, const char* key, Gains& gains);

template <class T>
void want(const json& from, const char* key, T& value) {
  const auto it = from.find(key);
  want_value(it == from.end() ? json() : *it, key, value);
}
template <class T>
void want(const json& from, const char* key, Maybe<T>& value) {
  if (const auto it = from.find(key); it != from.end()) want_value(*it, key, value.emplace());
}
void want_value(const json& value, const char* key, Gains& gains) {
  if (!value.is_object() || value.size() != 3) {
    throw RequestError(std::string(key) + " is an object of kp, ki and kd");
  }
  want(value, "kp", gains.kp);
  want(value, "ki", gains.ki);
  want(value, "kd", gains.kd);
}

}  // namespace

#define PROTOCOL_TAKE(member) want(from, #member, message.member);

#define PROTOCOL_REQUEST(Type, ...)                                          \
  template <>                                                                \
  struct Members<Type> {                                                     \
    static void put(json& to, const Type& message) {                         \
      to["request"] = Type::kName;                                           \
      NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(PROTOCOL_WRITE, __VA_ARGS__)) \
    }                                                                        \
    static void take(const json& from, Type& message) {                      \
      NLOHMANN_JSON_EXPAND(NLOHMANN_JSON_PASTE(PROTOCOL_TAKE, __VA_ARGS__))  \
    }                                                                        \
  };                                                                         \
  PROTOCOL_DEFINE(Type)

// Defines a request that consists of its name only.
#define PROTOCOL_QUESTION(Type)                                             \
  template <>                                                               \
  struct Members<Type> {                                                    \
    static void put(json& to, const Type&) { to["request"] = Type::kName; } \
    static void take(const json&, Type&) {}                                 \
  };                                                                        \
  PROTOCOL_DEFINE(Type)

template <>
struct Members<Expected> {
  static void put(json& to, const Expected& expected) {
    write(to, "set_point", expected.set_point);
    write(to, "output", expected.output);
    write(to, "mode", expected.mode);
  }
  static void take(const json& from, Expected& expected) {
    constexpr std::array<std::string_view, 3> kKeys{"set_point", "output", "mode"};
    if (!from.is_object()) throw RequestError("expect is an object");
    for (const auto& [key, value] : from.items()) {
      // Refuses unknown keys, so that the sender does not take them as accepted.
      if (std::find(kKeys.begin(), kKeys.end(), key) == kKeys.end()) {
        throw RequestError("expect has set_point, output and mode, not '" + key + "'");
      }
    }
    want(from, "set_point", expected.set_point);
    if (from.value("output", json(0)).is_null()) {
      expected.output = kNone;
    } else {
      want(from, "output", expected.output);
    }
    want(from, "mode", expected.mode);
  }
};
PROTOCOL_DEFINE(Expected)

template <>
struct Members<Person> {
  static void put(json& to, const Person& person) {
    write(to, "user", person.user);
    write(to, "address", person.address);
  }
  static void take(const json& from, Person& person) {
    want(from, "user", person.user);
    want(from, "address", person.address);
  }
};
PROTOCOL_DEFINE(Person)

PROTOCOL_QUESTION(StatusRequest)
PROTOCOL_QUESTION(DescribeRequest)
PROTOCOL_QUESTION(LinksRequest)
PROTOCOL_QUESTION(OverviewRequest)
PROTOCOL_QUESTION(AlarmsRequest)
PROTOCOL_REQUEST(AlarmDesignRequest, loop)
PROTOCOL_REQUEST(AlarmFiguresRequest, hours)
PROTOCOL_REQUEST(LoopRequest, loop)
PROTOCOL_REQUEST(WindowsRequest, loop)
PROTOCOL_REQUEST(TwinRequest, loop)
PROTOCOL_REQUEST(TrendRequest, loop, from, most)
PROTOCOL_REQUEST(RegistersRequest, values_only)
PROTOCOL_REQUEST(ExplainRequest, loop, alarm)
PROTOCOL_REQUEST(JournalRequest, most, before_id, kind, text, from_ms, to_ms, loop)
PROTOCOL_REQUEST(SetRequest, loop, set_point, output, mode, jacket, expect, user, address, session)
PROTOCOL_REQUEST(TuneRequest, loop, kp, ki, kd, expect, user, address)
PROTOCOL_JSON(TestTerms, pv, co, moved, manual, any_size, longest_s, plan)
PROTOCOL_REQUEST(CommissioningRequest, loop, session, test, move, withhold_s, end, why, user,
                 address)
PROTOCOL_REQUEST(OrderRequest, loop, order)
PROTOCOL_REQUEST(AlarmRequest, loop, alarm, action, reason, minutes, user, address)
PROTOCOL_REQUEST(AcknowledgeIncidentRequest, loop, incident, reason, user, address)
PROTOCOL_REQUEST(AcknowledgeAllRequest, reason, user, address)
PROTOCOL_REQUEST(TestResultRequest, loop, explanations, decided, predicted, probability, user,
                 address)
PROTOCOL_REQUEST(VetoRequest, loop, veto, reason, user, address)
PROTOCOL_REQUEST(OutcomeRequest, loop, found, note)
PROTOCOL_REQUEST(NoteRequest, loop, text, about_ms, user, address)
PROTOCOL_REQUEST(ReportsRequest, loop)
PROTOCOL_REQUEST(ReportRequest, loop, kind, from_ms, to_ms, user, address)
PROTOCOL_REQUEST(RecordRequest, loop, start, stop, at_most_s)
PROTOCOL_REQUEST(ReloadRequest, dry_run, take_file)
PROTOCOL_REQUEST(ReloadStateRequest, reload)

std::string name_of(const json& request) {
  std::string name;
  want(request, "request", name);
  return name;
}

}  // namespace loopwarden::protocol
