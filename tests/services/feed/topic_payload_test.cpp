// SPDX-License-Identifier: Apache-2.0
#include "services/feed/values/topic_payload.hpp"

#include <catch2/catch.hpp>

#include <string>

#include "services/feed/values/topics.hpp"

namespace topic_payload_test {

using namespace loopwarden::feed;
using loopwarden::protocol::FedValue;
using Quality = FedValue::Quality;

FedValue read(const PayloadRule& rule, const std::string& payload) {
  return read_topic_payload(rule, "FIC205.PV", payload);
}
// Returns the error for a bad payload, or an empty text for a good one.
std::string refused(const PayloadRule& rule, const std::string& payload) {
  try {
    read(rule, payload);
    return {};
  } catch (const BadTopicPayload& e) {
    return e.what();
  }
}
PayloadRule json_rule(TimeForm form = TimeForm::s, QualityCodes codes = QualityCodes::opc) {
  return {.value = JsonPointer("/d/0/v"),
          .time = JsonPointer("/t"),
          .time_form = form,
          .quality = JsonPointer("/q"),
          .quality_codes = codes};
}

TEST_CASE("a payload that is a number", "[feed]") {
  const FedValue fed = read({}, " 12.5\r\n");
  CHECK(fed.name == "FIC205.PV");
  CHECK(fed.value == 12.5);
  CHECK_FALSE(fed.time_s);
  CHECK(fed.quality == Quality::good);
  CHECK(read({}, "-1e-3").value == -0.001);
  for (const char* bad :
       {"", " ", "12,5", "12.5 m3/h", "nan", "inf", "1e999", "{\"v\": 1}", "0x10"}) {
    CAPTURE(bad);
    CHECK(refused({}, bad) == "expected a number");
  }
  CHECK(refused({}, std::string(kMostTopicBytes + 1, '1')) == "longer than 1 MiB");
}

TEST_CASE("a word if the rule accepts words", "[feed]") {
  const PayloadRule words{.words = true};
  CHECK(read(words, " AUTO\n").word == "AUTO");
  CHECK_FALSE(read(words, "AUTO").value);
  CHECK(read(words, "AUTO").quality == Quality::good);
  CHECK(read(words, "3").value == 3.0);
  CHECK(refused(words, "") == "expected a number or a word of at most 64 bytes");
  CHECK(refused(words, "\xff") == "expected a number or a word of at most 64 bytes");
  CHECK(refused(words, std::string(65, 'A')) == "expected a number or a word of at most 64 bytes");
  const PayloadRule in_json{.value = JsonPointer("/m"), .words = true};
  CHECK(read(in_json, R"({"m": "MAN"})").word == "MAN");
  CHECK(read(in_json, R"({"m": null})").quality == Quality::bad);
}

TEST_CASE("JSON gives value, time and quality at the pointers", "[feed]") {
  const FedValue fed = read(json_rule(), R"({"d": [{"v": 3.5}], "t": 1764000000.25, "q": 192})");
  CHECK(fed.value == 3.5);
  CHECK(fed.time_s == 1764000000.25);
  CHECK(fed.quality == Quality::good);
  CHECK(read(json_rule(TimeForm::ms), R"({"d": [{"v": "7"}], "t": 1764000000250, "q": "Good"})")
            .time_s == Approx(1764000000.25).margin(1e-6));
  const PayloadRule plain{.value = JsonPointer("")};
  CHECK(read(plain, "4").value == 4.0);
  CHECK(read(plain, "true").value == 1.0);
  CHECK(read(plain, "false").value == 0.0);
  CHECK(read(plain, R"(" 5.5 ")").value == 5.5);
  const FedValue null = read(plain, "null");
  CHECK_FALSE(null.value);
  CHECK(null.quality == Quality::bad);
}

TEST_CASE("JSON that does not match the rule is refused with the expected form and the place",
          "[feed]") {
  CHECK(refused(json_rule(), "{") == "expected JSON");
  CHECK(refused(json_rule(), R"({"d": {}, "t": 1, "q": 192})") == "expected a number at '/d/0/v'");
  CHECK(refused(json_rule(), R"({"d": [], "t": 1, "q": 192})") == "expected a number at '/d/0/v'");
  CHECK(refused(json_rule(), R"({"d": [{"v": "high"}], "t": 1, "q": 192})") ==
        "expected a number at '/d/0/v'");
  CHECK(refused(json_rule(), R"({"d": [{"v": 1}], "q": 192})") == "expected s since 1970 at '/t'");
  CHECK(refused(json_rule(), R"({"d": [{"v": 1}], "t": 1764000000250, "q": 192})") ==
        "expected s since 1970 at '/t'");  // they are ms
  CHECK(refused(json_rule(), R"({"d": [{"v": 1}], "t": -1, "q": 192})") ==
        "expected s since 1970 at '/t'");
  CHECK(refused(json_rule(), R"({"d": [{"v": 1}], "t": 1})") ==
        "expected good, uncertain, bad, true, false or a code at '/q'");
  CHECK(refused(json_rule(), R"({"d": [{"v": 1}], "t": 1, "q": "fine"})") ==
        "expected good, uncertain, bad, true, false or a code at '/q'");
}

TEST_CASE("qualities as words, flags and codes", "[feed]") {
  const auto quality = [](const std::string& q, QualityCodes codes = QualityCodes::opc) {
    return read(json_rule(TimeForm::s, codes), R"({"d": [{"v": 1}], "t": 1, "q": )" + q + "}")
        .quality;
  };
  CHECK(quality("\"UNCERTAIN\"") == Quality::uncertain);
  CHECK(quality("\"bad\"") == Quality::bad);
  CHECK(quality("true") == Quality::good);
  CHECK(quality("false") == Quality::bad);
  CHECK(quality("216") == Quality::good);  // good, local override
  CHECK(quality("64") == Quality::uncertain);
  CHECK(quality("0") == Quality::bad);
  CHECK(quality("500") == Quality::bad);  // Sparkplug: stale
  CHECK(quality("0", QualityCodes::opc_ua) == Quality::good);
  CHECK(quality("1073741824", QualityCodes::opc_ua) == Quality::uncertain);
  CHECK(quality("2147483648", QualityCodes::opc_ua) == Quality::bad);
  CHECK(quality("-1", QualityCodes::opc_ua) == Quality::bad);
}

TEST_CASE("times of ISO 8601 with a zone", "[feed]") {
  CHECK(parse_iso_time("2025-11-24T16:00:00Z") == 1764000000.0);
  CHECK(parse_iso_time("2025-11-24T17:00:00.25+01:00") == 1764000000.25);
  for (const char* bad : {"2025-11-24T16:00:00", "2025-11-24", "16:00:00Z", "", "Z",
                          "2025-13-24T16:00:00Z", "2025-02-30T16:00:00Z", "2025-11-24T16:00:60Z",
                          "2025-11-24T24:00:00Z", "2025-11-24T16:00:00Z and more"}) {
    CAPTURE(bad);
    CHECK_FALSE(parse_iso_time(bad));
  }
}

struct Heard {
  explicit Heard(const std::vector<TopicRule>& rules) : topics(rules) {}
  std::vector<FedValue> take(const std::string& topic, const std::string& payload,
                             bool retained = false, std::int64_t now_ms = 0) {
    std::vector<FedValue> values;
    complaint.clear();
    topics.take(topic, payload, retained, now_ms, values, complaint);
    return values;
  }
  std::vector<FedValue> look(std::int64_t now_ms) {
    std::vector<FedValue> values;
    topics.look(now_ms, values);
    return values;
  }
  Topics topics;
  std::string complaint;
};

const TopicRule kPv{.name = "PV", .topic = "a", .payload = {.value = JsonPointer("/pv")}};
const TopicRule kOp{.name = "OP", .topic = "a", .payload = {.value = JsonPointer("/op")}};

TEST_CASE("one message gives several values; one that can't be read is bad and counted", "[feed]") {
  Heard heard({kPv, kOp});
  auto values = heard.take("a", R"({"pv": 1, "op": "open"})");
  REQUIRE(values.size() == 2);
  CHECK(values[0].value == 1.0);
  CHECK(values[1].name == "OP");
  CHECK(values[1].quality == Quality::bad);
  CHECK_FALSE(values[1].value);
  CHECK(heard.complaint == "a, for OP: expected a number at '/op'");
  CHECK(heard.topics.counts().bad_payloads == 1);
  CHECK(heard.take("b", "1").empty());
  CHECK(heard.topics.counts().unknown == 1);
}

TEST_CASE("a retained message of unknown age is ignored unless the configuration accepts it",
          "[feed]") {
  TopicRule timed = kPv;
  timed.payload.time = JsonPointer("/t");
  TopicRule allowed{
      .name = "SP", .topic = "a", .payload = {.value = JsonPointer("/sp")}, .retained = true};
  Heard heard({timed, kOp, allowed});
  const auto values = heard.take("a", R"({"pv": 1, "op": 2, "sp": 3, "t": 5})", true);
  REQUIRE(values.size() == 2);
  CHECK(values[0].name == "PV");
  CHECK(values[1].name == "SP");
  CHECK(heard.topics.counts().retained == 1);
  CHECK(heard.take("a", R"({"pv": 1, "op": 2, "sp": 3, "t": 5})").size() == 3);
}

TEST_CASE("a topic that is silent for longer than its time-out is bad, once", "[feed]") {
  TopicRule rule = kPv;
  rule.timeout_ms = 5000;
  Heard heard({rule, kOp});
  CHECK(heard.look(100'000).empty());  // never received
  heard.take("a", R"({"pv": 1, "op": 2})", false, 100'000);
  CHECK(heard.look(105'000).empty());
  const auto values = heard.look(105'001);
  REQUIRE(values.size() == 1);
  CHECK(values[0].name == "PV");
  CHECK(values[0].quality == Quality::bad);
  CHECK(heard.look(200'000).empty());
  CHECK(heard.topics.counts().timeouts == 1);
  CHECK(heard.take("a", R"({"pv": 1, "op": 2})", false, 200'000)[0].quality == Quality::good);
}

TEST_CASE("without the broker the received values are bad", "[feed]") {
  TopicRule other{.name = "TT", .topic = "b"};
  Heard heard({kPv, other});
  heard.take("a", R"({"pv": 1})");
  std::vector<FedValue> values;
  heard.topics.disconnected(values);
  REQUIRE(values.size() == 1);
  CHECK(values[0].name == "PV");
  CHECK(values[0].quality == Quality::bad);
}

}  // namespace topic_payload_test
