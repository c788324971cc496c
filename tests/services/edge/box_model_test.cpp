// SPDX-License-Identifier: Apache-2.0
// The daemon's answers as metrics, and hosts' commands as requests.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "services/edge/command.hpp"
#include "services/edge/daemon_view.hpp"
#include "services/edge/file_parts.hpp"
#include "tests/support/fake_daemon.hpp"
#include "tests/support/temporary_folder.hpp"

namespace box_model_test {

using namespace loopwarden::edge;
using loopwarden::sparkplug::Bytes;
using loopwarden::sparkplug::DataType;
using loopwarden::sparkplug::Metric;
using loopwarden::sparkplug::Value;
using loopwarden::tests::FakeDaemon;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;
using json = nlohmann::json;

const MetricSpec& spec(const std::vector<MetricSpec>& specs, const std::string& name) {
  for (const MetricSpec& s : specs) {
    if (s.name == name) return s;
  }
  FAIL("no metric " << name);
  return specs.front();
}

Value value(const std::vector<MetricSpec>& specs, const Reading& reading, const std::string& name) {
  for (std::size_t i = 0; i < specs.size(); ++i) {
    if (specs[i].name == name) return reading.items.at(i).value;
  }
  FAIL("no metric " << name);
  return {};
}

// Omits the loop; the caller adds it later.
json request_of(const loopwarden::edge::Order& order) {
  json request = std::visit([](const auto& one) { return json(one); }, order.request);
  request.erase("loop");
  return request;
}

struct Seen {
  TemporaryFolder folder;
  FakeDaemon daemon{folder.path(), {"FIC-101", "A/B", "A+B"}};
  DaemonView view{folder.path(), DeadBands{.percent = 0.5, .by_metric = {{"pv", 2.0}}},
                  folder / "commissions"};

  const std::vector<MetricSpec>& specs() const { return view.model().loops().at(0).specs; }
  Value of_loop(const std::string& name) const {
    return value(specs(), view.loop_reading(0), name);
  }
};

TEST_CASE("every field of the map is one metric, with the loop's units and ranges", "[edge]") {
  Seen seen;
  CHECK(seen.view.look());
  REQUIRE(seen.view.model().loops().size() == 3);
  std::set<std::string> names;
  for (const MetricSpec& s : seen.specs()) CHECK(names.insert(s.name).second);
  const MetricSpec& pv = spec(seen.specs(), "pv");
  CHECK(pv.type == DataType::float32);
  CHECK(pv.unit == "L/min");
  CHECK((pv.low == 0.0 && pv.high == 10.0));
  CHECK(pv.dead_band_percent == 2.0);
  CHECK(spec(seen.specs(), "co").unit == "%");
  CHECK(spec(seen.specs(), "output").high == 100.0);
  CHECK(spec(seen.specs(), "ki").unit == "%/(L/min s)");
  CHECK_FALSE(spec(seen.specs(), "ki").high);
  CHECK(spec(seen.specs(), "mode").type == DataType::uint16);
  CHECK(spec(seen.specs(), "acknowledge_stiction").type == DataType::boolean);
  const MetricSpec& severity = spec(seen.specs(), "severity_stiction");
  CHECK(severity.type == DataType::float32);
  CHECK(severity.unit == "% of CO span");
  CHECK(severity.high == 100.0);
  CHECK(spec(seen.specs(), "sequence_head").slow);
  CHECK(seen.of_loop("tag") == Value(std::string("FIC-101")));
  CHECK(seen.of_loop("area") == Value(std::string("Utilities")));
  CHECK(seen.of_loop("description") == Value(std::string()));
  CHECK(seen.of_loop("pv") == Value(5.0));
  CHECK(seen.of_loop("mode") == Value(std::uint64_t{1}));
  CHECK(seen.of_loop("acknowledge_stiction") == Value(false));
  const auto& node = seen.view.model().node_specs();
  CHECK(node[0].name == "bdSeq");
  CHECK_FALSE(spec(node, "Node Control/Rebirth").aliased);
  const Reading box = seen.view.node_reading({{"daemon/online", true}});
  CHECK(value(node, box, "config_hash") == Value(std::uint64_t{77}));
  CHECK(value(node, box, "version") == Value(std::string("1.2.3")));
  CHECK(value(node, box, "daemon/online") == Value(true));
}

TEST_CASE("a watched loop offers no orders to its controller", "[edge]") {
  Seen seen;
  seen.daemon.set_elsewhere("A/B");
  seen.daemon.set("A/B", "condition_valve", 87.5);
  seen.daemon.set("A/B", "ki", 0.25);
  seen.view.look();
  const auto& here = seen.view.model().loops().at(0).specs;
  const auto& watched = seen.view.model().loops().at(1).specs;
  std::set<std::string> left_out;
  for (const MetricSpec& s : here) left_out.insert(s.name);
  for (const MetricSpec& s : watched) left_out.erase(s.name);
  CHECK(left_out == std::set<std::string>{"output", "veto_corrective_action"});
  const Reading now = seen.view.loop_reading(1);
  CHECK(now.items.size() == watched.size());
  CHECK(value(watched, now, "ki") == Value(0.25));
  CHECK(value(watched, now, "acknowledge_stiction") == Value(false));
  CHECK(value(watched, now, "condition/valve") == Value(87.5));
  CHECK(value(watched, now, "tag") == Value(std::string("A/B")));
}

TEST_CASE("tags that a topic can't hold get replacement names", "[edge]") {
  Seen seen;
  seen.view.look();
  CHECK(seen.view.model().loops()[1].device == "A_B");
  CHECK(seen.view.model().loops()[2].device == "A_B_2");
  CHECK(seen.view.model().find("A_B_2")->tag == "A+B");
  CHECK(seen.view.model().find("A/B") == nullptr);
}

TEST_CASE("an unknown scaled value is null; a bad PV is marked", "[edge]") {
  Seen seen;
  seen.view.look();
  CHECK(seen.of_loop("condition_valve") == Value{});
  CHECK(seen.of_loop("condition/valve") == Value{});
  seen.daemon.set("FIC-101", "condition_valve", 87.5);
  seen.daemon.set("FIC-101", "pv_quality", 0);
  CHECK_FALSE(seen.view.look());
  CHECK(seen.of_loop("condition/valve") == Value(87.5));
  const Reading now = seen.view.loop_reading(0);
  for (std::size_t i = 0; i < seen.specs().size(); ++i) {
    const std::string& name = seen.specs()[i].name;
    CHECK(now.items[i].good == (name != "pv" && name != "pv_scaled"));
  }
}

TEST_CASE("alarms and explanations are requested when their registers change", "[edge]") {
  Seen seen;
  seen.view.look();
  CHECK(seen.of_loop("alarm/stiction/state") == Value{});
  const std::size_t quiet = seen.daemon.looks();
  seen.view.look();
  CHECK(seen.daemon.looks() == quiet + 1);
  seen.daemon.set_alarm("FIC-101", {{"alarm", "stiction"},
                                    {"state", "unacknowledged"},
                                    {"severity_percent", 6.5},
                                    {"raised_ms", 1'700'000'000'000}});
  seen.daemon.set("FIC-101", "alarm_stiction", 1);
  seen.daemon.set_explanation("FIC-101", {{"alarm", "stiction"},
                                          {"verdict", "missing_effect"},
                                          {"effect", "stiction"},
                                          {"size_percent", 6.4},
                                          {"low_percent", nullptr},
                                          {"agrees", true},
                                          {"sentence", "It sticks."},
                                          {"raised_ms", 1'700'000'000'000}});
  seen.daemon.set("FIC-101", "explanation_alarm", 1);
  seen.view.look();
  CHECK(seen.of_loop("alarm/stiction/state") == Value(std::string("unacknowledged")));
  CHECK(seen.of_loop("alarm/stiction/severity") == Value(6.5));
  CHECK(seen.of_loop("alarm/stiction/since") == Value(std::uint64_t{1'700'000'000'000}));
  CHECK(seen.of_loop("alarm/backlash/state") == Value{});
  CHECK(seen.of_loop("explanation/sentence") == Value(std::string("It sticks.")));
  CHECK(seen.of_loop("explanation/size") == Value(6.4));
  CHECK(seen.of_loop("explanation/low") == Value{});
  CHECK(seen.of_loop("explanation/agrees") == Value(true));
  CHECK(seen.view.unacknowledged(0) == std::vector<std::string>{"stiction"});
  CHECK(seen.view.unacknowledged(1).empty());
}

TEST_CASE("an incident is published with its name and cause", "[edge]") {
  Seen seen;
  seen.view.look();
  CHECK(seen.of_loop("incident/name") == Value{});
  seen.daemon.set_incident({{"id", "FIC-101-20261124T145805Z"},
                            {"loop", "FIC-101"},
                            {"name", "gain_change"},
                            {"cause", "process"},
                            {"raised_s", 1'700'000'000.0},
                            {"confidence", 0.9},
                            {"active", true}});
  seen.view.look();
  CHECK(seen.of_loop("incident/id") == Value(std::string("FIC-101-20261124T145805Z")));
  CHECK(seen.of_loop("incident/name") == Value(std::string("gain_change")));
  CHECK(seen.of_loop("incident/cause") == Value(std::string("process")));
  CHECK(seen.of_loop("incident/confidence") == Value(0.9));
  CHECK(seen.of_loop("incident/active") == Value(true));
  CHECK(seen.of_loop("incident/unacknowledged") == Value(false));
  CHECK(seen.of_loop("incident/raised") == Value(std::uint64_t{1'700'000'000'000}));
}

TEST_CASE("a process alarm is published although it is in no register; it has no size", "[edge]") {
  Seen seen;
  seen.view.look();
  seen.daemon.set_alarm("FIC-101", {{"alarm", "bad_pv"},
                                    {"state", "unacknowledged"},
                                    {"severity_percent", nullptr},
                                    {"raised_ms", 1'700'000'000'000}});
  seen.view.look();
  CHECK(seen.of_loop("alarm/bad_pv/state") == Value(std::string("unacknowledged")));
  CHECK(seen.of_loop("alarm/bad_pv/since") == Value(std::uint64_t{1'700'000'000'000}));
  CHECK(seen.view.unacknowledged(0) == std::vector<std::string>{"bad_pv"});
  const auto has = [&](const std::string& name) {
    return std::any_of(seen.specs().begin(), seen.specs().end(),
                       [&](const MetricSpec& one) { return one.name == name; });
  };
  CHECK(has("alarm/output_lost/state"));
  CHECK(has("alarm/output_unknown/since"));
  CHECK(has("alarm/not_normal_mode/state"));
  CHECK_FALSE(has("alarm/bad_pv/severity"));
  CHECK(has("alarm/model_gap/severity"));
}

TEST_CASE("detectable sizes come from the loop's commission", "[edge]") {
  Seen seen;
  write_file(seen.folder / "commissions/FIC-101/commission.json",
             R"({"detectable": {"stiction": {"percent_of_span": 1.5},
                         "backlash": {"percent_of_span": null}}})");
  seen.view.look();
  CHECK(seen.of_loop("detectable/stiction") == Value(1.5));
  CHECK(spec(seen.specs(), "detectable/stiction").unit == "% of CO span");
  CHECK(seen.specs().size() == seen.view.model().loops()[1].specs.size() + 1);
}

TEST_CASE("a reloaded configuration makes a new model if units or loops changed", "[edge]") {
  Seen seen;
  CHECK(seen.view.look());
  seen.daemon.set_box("config_hash", 78);
  CHECK_FALSE(seen.view.look());
  seen.daemon.set_unit("m3/h");
  seen.daemon.set_box("config_hash", 79);
  CHECK(seen.view.look());
  CHECK(spec(seen.specs(), "pv").unit == "m3/h");
}

TEST_CASE("a daemon that stops is offline, and the same daemon when it returns", "[edge]") {
  Seen seen;
  seen.view.look();
  seen.daemon.stop();
  CHECK_THROWS_AS(seen.view.look(), loopwarden::protocol::DaemonError);
  seen.daemon.start();
  CHECK_FALSE(seen.view.look());
  CHECK(seen.of_loop("pv") == Value(5.0));
}

TEST_CASE("evidence is found by alarm or by its folder's name, and in no other way", "[edge]") {
  Seen seen;
  seen.view.look();
  const auto folder = seen.folder / "evidence/one";
  write_file(folder / "evidence.json", R"({"loop": "FIC-101"})");
  CHECK_FALSE(seen.view.evidence(0, "stiction"));
  seen.daemon.set_evidence(folder);
  CHECK(seen.view.evidence(0, "stiction") == folder);
  CHECK(seen.view.evidence(0, "one") == folder);
  CHECK_FALSE(seen.view.evidence(1, "one"));  // an incident of another loop
  for (const char* wanted : {"", ".", "..", "../evidence/one", "/etc", "none"}) {
    INFO(wanted);
    CHECK_FALSE(seen.view.evidence(0, wanted));
  }
}

TEST_CASE("a file is sent in numbered parts with a check sum of the whole", "[edge]") {
  const TemporaryFolder folder;
  write_file(folder / "e1/evidence.json", "{}");
  write_file(folder / "e1/record.csv", "0123456789");
  write_file(folder / "e1/report.html", std::string(101, 'x'));
  write_file(folder / "e1/other", "not offered");
  FileParts parts(100, 4);
  CHECK(parts.add("d", "stiction", folder / "e1") ==
        "left out: report.html is larger than 100 bytes");
  const auto first = parts.next();
  REQUIRE(first);
  CHECK(first->metric.name == "file/evidence.json");
  CHECK(first->metric.value == Value(Bytes{"{}"}));
  CHECK(first->metric.property("parts")->value == Value(std::uint64_t{1}));
  CHECK(first->metric.property("files")->value == Value(std::uint64_t{2}));
  CHECK(first->metric.property("request")->value == Value(std::string("stiction")));
  // A part that was not sent is returned again.
  CHECK(parts.next()->metric == first->metric);
  parts.gone();
  std::string whole;
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto part = parts.next();
    REQUIRE(part);
    CHECK(part->device == "d");
    CHECK(part->metric.name == "file/record.csv");
    CHECK(part->metric.type == DataType::file);
    CHECK(part->metric.property("part")->value == Value(i));
    CHECK(part->metric.property("parts")->value == Value(std::uint64_t{3}));
    CHECK(part->metric.property("folder")->value == Value(std::string("e1")));
    CHECK(part->metric.property("sha256")->value ==
          Value(std::string("84d89877f0d4041efb6bf91a16f0248f2fd573e6af05c19f96bedb9f882f7882")));
    REQUIRE(part->metric.metadata);
    CHECK(part->metric.metadata->size == 10);
    CHECK(part->metric.metadata->part == i);
    CHECK(part->metric.metadata->file_name == "record.csv");
    whole += std::get<Bytes>(part->metric.value).data;
    parts.gone();
  }
  CHECK(whole == "0123456789");
  CHECK_FALSE(parts.next());
  CHECK_THAT(parts.add("d", "e2", folder / "none"), Catch::StartsWith("refused: no file exists"));
}

Metric wanted(std::string name, Value value) {
  Metric metric;
  metric.name = std::move(name);
  metric.value = std::move(value);
  return metric;
}

TEST_CASE("set point, mode and output of one message are one order", "[edge]") {
  const Command command = read_command(
      {wanted("sp", 5.5), wanted("mode", std::uint64_t{1}), wanted("output", 40.0)}, true);
  REQUIRE(command.orders.size() == 1);
  CHECK(request_of(command.orders[0]) ==
        json{{"request", "set"}, {"set_point", 5.5}, {"mode", "auto"}, {"output", 40.0}});
  CHECK(command.orders[0].what == "sp 5.5, mode 1, output 40");
  CHECK(command.refused.empty());
}

TEST_CASE("alarms, shelves, vetoes and evidence", "[edge]") {
  const Command command = read_command(
      {wanted("acknowledge_low_air_supply", true), wanted("reset_stiction", true),
       wanted("shelve_unknown", std::uint64_t{30}), wanted("shelve_stiction", std::uint64_t{0}),
       wanted("veto_corrective_action", false), wanted("calm_stiction", std::uint64_t{1}),
       wanted("request/evidence", std::string("stiction"))},
      true);
  REQUIRE(command.orders.size() == 6);
  CHECK(request_of(command.orders[0]) ==
        json{{"request", "alarm"}, {"alarm", "low_air_supply"}, {"action", "acknowledge"}});
  CHECK(request_of(command.orders[1]) ==
        json{{"request", "alarm"}, {"alarm", "stiction"}, {"action", "reset"}});
  CHECK(request_of(command.orders[2]) ==
        json{{"request", "alarm"}, {"alarm", "unknown"}, {"action", "shelve"}, {"minutes", 30}});
  CHECK(request_of(command.orders[3]) ==
        json{{"request", "alarm"}, {"alarm", "stiction"}, {"action", "unshelve"}});
  CHECK(request_of(command.orders[4]) == json{{"request", "veto"}, {"veto", false}});
  CHECK(request_of(command.orders[5]) ==
        json{{"request", "alarm"}, {"alarm", "stiction"}, {"action", "calm"}});
  CHECK(command.evidence == std::vector<std::string>{"stiction"});
}

TEST_CASE("a write that is not a command is reported and has no effect", "[edge]") {
  const double nan = std::nan("");
  for (const Metric& metric :
       {wanted("pv", 5.0), wanted("kp", 1.0), wanted("sp", nan), wanted("sp", std::string("5")),
        wanted("sp", {}), wanted("mode", std::uint64_t{2}), wanted("acknowledge_stiction", false),
        wanted("shelve_stiction", -1.0), wanted("shelve_stiction", 0.5), wanted("", true),
        wanted("request/evidence", true)}) {
    INFO(metric.name);
    const Command command = read_command({metric}, true);
    CHECK(command.orders.empty());
    CHECK(command.refused.size() == 1);
  }
  CHECK(read_command({wanted("Node Control/Rebirth", true)}, false).rebirth);
  CHECK_FALSE(read_command({wanted("Node Control/Rebirth", false)}, false).rebirth);
  CHECK(read_command({wanted("acknowledge_all", true)}, false).acknowledge_all);
  CHECK(read_command({wanted("sp", 5.0)}, false).refused.size() == 1);
}

}  // namespace box_model_test
