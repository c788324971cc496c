// SPDX-License-Identifier: Apache-2.0
// The work list, its costs, the names of loops, and copies of a record.
#include "workbench/survey/worklist.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "model/numeric/random.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/workbench/survey/survey_support.hpp"
#include "workbench/survey/join.hpp"
#include "workbench/survey/neighbours.hpp"
#include "workbench/survey/site_names.hpp"

namespace loopwarden::tests::worklist_test {
namespace {

using nlohmann::json;
using namespace loopwarden::workbench;
using Catch::Contains;

json with_swing(json loop, double percent, const std::string& kind = "flow") {
  loop["kind"] = kind;
  loop["swing_percent"] = percent;
  loop["travel_per_hour"] = 0.0;
  return loop;
}

json swinging(const std::string& tag, const std::string& cause, double period_s = 60.0) {
  json loop = with_swing(caused_loop(tag, cause, 1.0), 2.0);
  loop["period_s"] = period_s;
  return loop;
}

json list_of(std::vector<json> loops, const SiteSettings& site = {}, const Costs& costs = {}) {
  return worklist(join_survey(std::move(loops), json::array(), {}, site), costs);
}

TEST_CASE("tags are shown without server, folders and block", "[survey][worklist]") {
  for (const auto& [tag, shown] : {std::pair{"[default]Plant/Area1/PIC1112", "PIC1112"},
                                   {"dcs.FIC1116", "FIC1116"},
                                   {"PIC1105/PID1", "PIC1105"},
                                   {"Unit 2\\21-FIC-105A", "21-FIC-105A"},
                                   {"::[PLC01]Program:Main.FIC308", "FIC308"},
                                   {"FIC101", "FIC101"},
                                   {"boiler.temp", "boiler.temp"},
                                   {"", ""}}) {
    CHECK(instrument_part(tag) == shown);
  }
  std::vector<json> loops{survey_loop("[default]Plant/Area1/PIC1112", "healthy"),
                          survey_loop("dcs.FIC1116", "healthy"), survey_loop("A.FIC7", "healthy"),
                          survey_loop("B.FIC7", "healthy"), survey_loop("r05", "healthy")};
  name_loops(loops, {}, std::nullopt);
  CHECK(loops[0]["shown"] == "PIC1112");
  CHECK(loops[0]["area"] == "Plant/Area1");
  CHECK(loops[1]["area"] == "11");
  CHECK(loops[2]["shown"] == "A.FIC7");  // two loops would have one name
  CHECK(loops[4]["area_from"].is_null());
  // The site's rule decides.
  std::vector<record::TagText> rules(1);
  rules[0].pattern = record::TagPattern("dcs.*");
  rules[0].show = "DCS-$1";
  rules[0].area = "Unit 2/Reactor";
  name_loops(loops, rules, std::nullopt);
  CHECK(loops[1]["shown"] == "DCS-FIC1116");
  CHECK(loops[1]["area"] == "Unit 2/Reactor");
}

TEST_CASE("a group has a likely source only among loops that share a unit", "[survey][worklist]") {
  const auto source_of = [](const std::string& tag, const std::string& other, bool clock) {
    json sticking = with_swing(valve_loop(other, 4.0), 2.0);
    json follower = swinging(tag, "disturbance");
    if (!clock) sticking["import"]["start"] = follower["import"]["start"] = nullptr;
    const json survey = join_survey({sticking, follower}, json::array(), {});
    for (const json& loop : survey["loops"]) {
      if (loop["tag"] == tag)
        return std::pair(loop["likely_source"], loop["next"]["why"].get<std::string>());
    }
    return std::pair(json(), std::string());
  };
  CHECK(source_of("FIC2101", "FIC2102", false).first == "FIC2102");  // the number
  CHECK_THAT(source_of("P/A1/FIC1", "P/A1/FIC2", false).second, Contains("with FIC2: look there"));
  CHECK(source_of("P/A1/FIC1", "P/A2/FIC2", true).first.is_null());
  CHECK(source_of("FIC2101", "FIC3102", true).first.is_null());
  CHECK(source_of("r05", "r11", true).first == "r11");  // one time
  CHECK(source_of("r05", "r11", false).first.is_null());
  CHECK_THAT(source_of("r05", "r11", false).second, Contains("a loop with the same period, 60 s"));
}

TEST_CASE("one order serves the loops that follow a sticking valve", "[survey][worklist]") {
  const json orders =
      list_of({with_swing(valve_loop("FIC2102", 4.0), 2.0), swinging("FIC2101", "disturbance"),
               swinging("FIC3101", "tuning", 9.0), with_swing(survey_loop("FIC9", "healthy"), 0.1),
               with_swing(survey_loop("FIC8", "cant_tell"), 5.0)});
  REQUIRE(orders.size() == 2);
  CHECK(orders[0]["tag"] == "FIC2102");
  CHECK(orders[0]["order"] == 1);
  CHECK(orders[0]["action"] == "repair");
  CHECK(orders[0]["who"] == "technician");
  CHECK(orders[0]["shutdown"] == true);
  CHECK(orders[0]["confidence"] == "high");
  CHECK(orders[0]["also_steadies"] == json{"FIC2101"});
  // Half to nine tenths of 100 to 1000 for each of 2 % of two loops.
  CHECK(orders[0]["saving_low"] == 200.0);
  CHECK(orders[0]["saving_high"] == 3600.0);
  CHECK(orders[1]["action"] == "tune");
  CHECK(orders[1]["also_steadies"].empty());
  for (const json& order : orders) {
    CHECK(order["short_text"].get<std::string>().size() <= 40);
    CHECK(order["saving_low"] < order["saving_high"]);
  }
  const std::string csv = worklist_csv(orders);
  CHECK_THAT(csv, Contains("1,FIC2102 repair,\"Repair: FIC2102, stiction 4 %\",FIC2102,repair,"
                           "technician,yes,240,200,3600,EUR,high,0.95,stiction 4 %,"));
  const std::string reference = read_file(LOOPWARDEN_SOURCE_DIR "/docs/reference/worklist.md");
  const std::string head = csv.substr(0, csv.find('\n'));
  for (std::size_t from = 0; from < head.size();) {
    const std::size_t to = std::min(head.find(',', from), head.size());
    INFO(head.substr(from, to - from));
    CHECK_THAT(reference, Contains("`" + head.substr(from, to - from) + "`"));
    from = to + 1;
  }
}

TEST_CASE("an order to repair names the first checks of its fault", "[survey][worklist]") {
  const std::string faults = read_file(LOOPWARDEN_SOURCE_DIR "/docs/explanation/valve-faults.md");
  for (const std::string effect : {"stiction", "backlash"}) {
    const std::size_t row = faults.find("| [" + effect + "](#" + effect + ")");
    REQUIRE(row != std::string::npos);
    const std::string line = faults.substr(row, faults.find('\n', row) - row);
    std::string checks = line.substr(line.rfind("| ", line.size() - 3) + 2);
    checks = checks.substr(0, checks.find(" |"));
    checks.replace(checks.find(", "), 2, " and ");
    const json order = list_of({with_swing(valve_loop("FIC1", 4.0, effect), 2.0)})[0];
    CHECK_THAT(order["text"].get<std::string>(), Contains("Check " + checks + " first;"));
  }
}

TEST_CASE("the planned test of a loop gives person and minutes of its order",
          "[survey][worklist]") {
  const auto order_of = [](const json& test, const Costs& costs = {}) {
    json loop = with_swing(valve_loop("FIC1", 4.0, "stiction", "likely"), 2.0);
    loop["oscillating"] = false;
    loop["next_test"] = test;
    return list_of({loop}, {}, costs).at(0);
  };
  const auto planned = [](const char* allowed_by) {
    return json{{"text", "Move CO. Permission: operator."},
                {"move", "output_step"},
                {"duration_s", 1450.0},
                {"allowed_by", allowed_by != nullptr ? json(allowed_by) : json()}};
  };
  const json technician = order_of(planned("technician"));
  CHECK(technician["action"] == "test the valve");
  CHECK(technician["who"] == "technician");
  CHECK(technician["minutes"] == 55.0);  // 30 min, and the test
  CHECK(technician["shutdown"] == false);
  CHECK(technician["text"] == "Move CO. Permission: operator.");
  CHECK(order_of(planned("operator"))["who"] == "operator");
  for (const char* beyond : {static_cast<const char*>(nullptr), "test day"}) {
    CHECK(order_of(planned(beyond))["who"] == "control engineer");
    CHECK(order_of(planned(beyond))["minutes"] == 480.0);
  }
  // No move decides: an hour of record.
  const json none = order_of({{"text", "Record an hour."}, {"move", nullptr}});
  CHECK(none["action"] == "look closer");
  CHECK(none["who"] == "operator");
  CHECK(none["minutes"] == 90.0);
  // No response of PV: a stroke over the whole travel.
  const json stroke = order_of(nullptr);
  CHECK(stroke["action"] == "test the valve");
  CHECK(stroke["shutdown"] == true);
  CHECK_THAT(stroke["text"].get<std::string>(), Contains("stroke the valve."));
  // The site's names of the persons.
  const auto costs = read_costs_text("c.yaml", "work: {test: {who: fitter, minutes: 10}}\n");
  REQUIRE(costs);
  CHECK(order_of(planned("technician"), *costs)["who"] == "fitter");
  CHECK(order_of(planned("technician"), *costs)["minutes"] == 35.0);
}

TEST_CASE("times and probabilities of the CSV have one form", "[survey][worklist]") {
  json zoned = with_swing(valve_loop("FIC1", 4.0), 2.0);
  zoned["probability"] = 0.943487;
  json local = with_swing(valve_loop("FIC2", 4.0), 1.0);
  local["import"]["start"] = "2026-10-01T00:00:00.500";
  const std::string csv = worklist_csv(list_of({zoned, local}));
  CHECK_THAT(csv, Contains(",high,0.94,stiction") && Contains(",high,0.95,stiction"));
  for (const char* tag : {"FIC1", "FIC2"}) {
    CHECK_THAT(csv,
               Contains(std::string(",") + tag + ",2026-10-01T00:00:00,2026-10-01T08:00:00\n"));
  }
}

TEST_CASE("the list names the slave's valve in place of the master's tuning",
          "[survey][worklist][cascade]") {
  SiteSettings site;
  site.tags.resize(1);
  site.tags[0].pattern = record::TagPattern("*FIC101");
  site.tags[0].master = "TIC101";
  const json master = swinging("dcs.TIC101", "tuning");
  const json orders = list_of({with_swing(valve_loop("dcs.FIC101", 4.0), 2.0), master}, site);
  REQUIRE(orders.size() == 1);
  CHECK(orders[0]["tag"] == "FIC101");
  CHECK(orders[0]["action"] == "repair");
  CHECK(orders[0]["also_steadies"] == json{"TIC101"});
  // A slave that only follows its set point has its order at the master.
  const json other = list_of({swinging("dcs.FIC101", "master_loop"), master}, site);
  REQUIRE(other.size() == 1);
  CHECK(other[0]["tag"] == "TIC101");
  CHECK(other[0]["action"] == "tune");
  // A healthy slave does not stop the tuning of its master.
  CHECK(list_of({with_swing(survey_loop("dcs.FIC101", "healthy"), 0.1), master},
                site)[0]["action"] == "tune");
}

TEST_CASE("areas and masters come from loop files, and diagnose names the master",
          "[survey][worklist][cascade][program]") {
  const TemporaryFolder folder;
  const std::string record = LOOPWARDEN_SOURCE_DIR "/examples/routine/r22.csv";
  write_file(folder / "exports/FIC-205.csv", read_file(record));
  write_file(folder / "etc/loopwardend.yaml", "feeders: {plant: {user: root}}\n");
  const auto loop_file = [&](const std::string& tag, const std::string& more) {
    write_file(folder / ("etc/loops.d/" + tag + ".yaml"),
               "loop: " + tag + "\ncontrol: elsewhere\nsample_time: 1\n" + more +
                   "process_variable: {unit: m3/h, range: [0, 40]}\n"
                   "output: {unit: \"%\", range: [0, 100]}\nio:\n  backend: feed\n  pv: {feed: "
                   "\"plant:" +
                   tag + ".PV\"}\n  co: {feed: \"plant:" + tag + ".OP\"}\n");
  };
  loop_file("TIC-101", "");
  loop_file("FIC-205", "area: Unit 2/Reactor\ncascade: {master: TIC-101}\n");
  const ShellOutcome surveyed =
      run("cd " + folder.path().string() +
          " && " LOOPWARDEN_CLI " survey exports --out s --loop-files etc --json 2>/dev/null");
  REQUIRE(surveyed.exit_code == 0);
  const json loop = json::parse(surveyed.text)["loops"][0];
  CHECK(loop["area"] == "Unit 2/Reactor");
  CHECK(loop["master"] == "TIC-101");
  CHECK_THAT(run(LOOPWARDEN_CLI " diagnose " + record + " --master TIC-101").text,
             Contains("master: TIC-101 moves the set point"));
  // A tag of --loops without a loop is reported with its line.
  write_file(folder / "loops.csv", "tag,cost_per_hour\nFIC-205,1\nFIC999,3\n");
  const std::string told =
      run("cd " + folder.path().string() +
          " && " LOOPWARDEN_CLI " survey exports --out s --loops loops.csv 2>&1")
          .text;
  CHECK_THAT(told, Contains("loops.csv:3: 'FIC999' matches no loop\n"));
  CHECK_THAT(told, !Contains("'FIC-205' matches no loop"));
}

TEST_CASE("costs of a site replace the defaults, and errors are strict", "[survey][worklist]") {
  const auto costs = read_costs_text("c.yaml",
                                     "currency: USD\n"
                                     "loss: {flow: [1000, 2000]}\n"
                                     "work: {repair: {who: fitter, minutes: 90, shutdown: false, "
                                     "removes: [0.5, 1]}}\n");
  REQUIRE(costs);
  const json order = list_of({with_swing(valve_loop("FIC1", 4.0), 2.0)}, {}, *costs)[0];
  CHECK(order["saving_low"] == 1000.0);
  CHECK(order["saving_high"] == 4000.0);
  CHECK(order["currency"] == "USD");
  CHECK(order["who"] == "fitter");
  CHECK(order["minutes"] == 90.0);
  const auto error_of = [](const char* text) {
    return config::to_text(read_costs_text("c.yaml", text).diagnostics);
  };
  CHECK_THAT(error_of("loss: {flw: [1, 2]}\n"),
             Contains("c.yaml:1:") && Contains("did you mean 'flow'?"));
  CHECK_THAT(error_of("loss: {flow: [2, 1]}\n"), Contains("loss.flow"));
  const TemporaryFolder folder;
  write_file(folder / "c.yaml", "per_hour: 20\n");
  CHECK_THROWS_WITH(read_costs_file(folder / "c.yaml"),
                    Contains("c.yaml: can't be used. Its keys: currency, hours_per_year, "
                             "loss, loss.flow, ") &&
                        Contains("valve.overhaul"));
  CHECK_THAT(error_of("loss: {flow: 5}\n"), Contains("loss.flow"));
  CHECK_THAT(error_of("work: {repair: {removes: [0, 2]}}\n"), Contains("removes"));
  CHECK_THAT(error_of("hours_per_year: 9000\n"), Contains("hours_per_year"));
  const std::string reference = read_file(LOOPWARDEN_SOURCE_DIR "/docs/reference/worklist.md");
  const config::KeyReference keys = describe_costs();
  for (const config::KeyDescription& key : keys.keys()) {
    INFO(key.path);
    CHECK(reference.find(key.path.substr(key.path.find_last_of('.') + 1)) != std::string::npos);
  }
  // A known cost of the loop replaces the assumed loss.
  LoopWeights weights;
  weights["FIC1"].cost_per_hour = 1.0;
  const json survey = join_survey({with_swing(valve_loop("FIC1", 4.0), 2.0)}, json::array(), {});
  CHECK(worklist(survey, {}, weights)[0]["saving_high"] == 7200.0);
}

TEST_CASE("a sensor at rest is an order to check the transmitter", "[survey][worklist]") {
  const json orders = list_of({swinging("PIC1", "sensor")});
  CHECK(orders[0]["action"] == "check the transmitter");
  CHECK(orders[0]["who"] == "technician");
}

TimedLoop timed(const std::string& tag, std::uint64_t seed, double step_s = 1.0,
                std::size_t samples = 2000) {
  TimedLoop loop{.tag = tag, .step_s = step_s, .to_s = step_s * static_cast<double>(samples - 1)};
  numeric::Random random(seed);
  double slow = 0.0;
  for (std::size_t k = 0; k < samples; ++k) {
    // The same steps of the set point in all loops.
    const double sp = k / 400 % 2 == 0 ? 40.0 : 45.0;
    slow = 0.99 * slow + 0.1 * random.normal();
    loop.pv.push_back(static_cast<float>(sp + slow + 0.1 * random.normal()));
    loop.co.push_back(static_cast<float>(50.0 + sp / 5.0 - 2.0 * slow));
  }
  return loop;
}

TEST_CASE("copies of a record are found, and loops that act alike are not", "[survey][worklist]") {
  const TimedLoop a = timed("FIC1", 1);
  TimedLoop rounded = a;
  rounded.tag = "FIC1_copy";
  for (float& v : rounded.pv) v = std::round(v * 50.0F) / 50.0F;
  TimedLoop sparse = timed("FIC1_sparse", 1);
  sparse.step_s = 3.0;
  sparse.pv.clear();
  sparse.co.clear();
  for (std::size_t k = 1; k < a.pv.size(); k += 3) {  // the last sample is in both
    sparse.pv.push_back(a.pv[k]);
    sparse.co.push_back(a.co[k]);
  }
  sparse.from_s = 1.0;
  const std::vector<TimedLoop> loops{timed("FIC2", 2), rounded, a, sparse, timed("FIC3", 3)};
  CHECK(find_duplicates(loops) == std::vector<std::size_t>{0, 2, 2, 2, 4});
  // Records at rest have nothing to compare.
  TimedLoop still = a;
  std::fill(still.pv.begin(), still.pv.end(), 5.0F);
  TimedLoop other = still;
  other.tag = "FIC9";
  CHECK(find_duplicates(std::vector<TimedLoop>{still, other}) == std::vector<std::size_t>{0, 1});
  CHECK(find_duplicates({}).empty());
}

TEST_CASE("loops in thirty layouts of historians are read without an option",
          "[survey][worklist][program]") {
  TemporaryFolder folder;
  const auto path = [&](const char* name) { return (folder / name).string(); };
  std::string text = "Timestamp";
  for (int loop = 0; loop < 30; ++loop) {
    char names[64];
    std::snprintf(names, sizeof names, ",FIC1%02d.PV,FIC1%02d.OP,FIC1%02d.SP", loop, loop, loop);
    text += names;
  }
  numeric::Random random(5);
  for (int k = 0; k < 400; ++k) {
    char cells[64];
    std::snprintf(cells, sizeof cells, "\n2026-03-01T%02d:%02d:%02dZ", k / 360, k / 6 % 60,
                  k % 6 * 10);
    text += cells;
    for (int loop = 0; loop < 30; ++loop) {
      const double swing = std::sin(0.1 * k) + random.normal();
      std::snprintf(cells, sizeof cells, ",%.3f,%.2f,20", 20.0 + 0.2 * swing, 50.0 - swing);
      text += cells;
    }
  }
  std::filesystem::create_directory(folder / "plant");
  write_file(folder / "plant/u.csv", text + "\n");
  const ShellOutcome made = run("python3 " LOOPWARDEN_SOURCE_DIR "/lab/plant_study/layouts.py " +
                                path("plant") + " " + path("exports") + " 2>&1");
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  const ShellOutcome told =
      run(LOOPWARDEN_CLI " survey " + path("exports") + " --out " + path("s") + " 2>&1");
  INFO(told.text);
  CHECK(told.exit_code == 0);
  CHECK_THAT(told.text, Contains("30 files: 30 read, 0 could not be read; 30 loops: 30 judged"));
  const json survey = json::parse(read_file(folder / "s/survey.json"));
  REQUIRE(survey["loops"].size() == 30);
  for (const json& loop : survey["loops"]) {
    INFO(loop["tag"]);
    CHECK(loop["shown"].get<std::string>().size() == 6);
  }
  CHECK(read_file(folder / "s/worklist.csv").starts_with("order,id,short_text,tag,action,who,"));
}

}  // namespace
}  // namespace loopwarden::tests::worklist_test
