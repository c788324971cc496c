// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/register_map_text.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <string>
#include <utility>

#include "daemon/registers/register_map.hpp"
#include "tests/support/temporary_folder.hpp"

namespace register_map_test {

using namespace loopwarden;
using namespace loopwarden::workbench;

namespace {

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) {
    ++found;
  }
  return found;
}

std::size_t registers_of(std::size_t loops) {
  std::size_t all = 0;
  for (const registers::Register& reg : registers::registers()) {
    all += reg.area == registers::Area::box ? 1 : loops;
  }
  return all;
}

nlohmann::json node_of(const std::string& flow, const std::string& id) {
  for (const nlohmann::json& node : nlohmann::json::parse(flow)) {
    if (node.at("id") == id) return node;
  }
  FAIL("no node " << id);
  return {};
}

}  // namespace

TEST_CASE("docs/reference/modbus-map.md and .csv match the table", "[register_map]") {
  const std::string folder = LOOPWARDEN_SOURCE_DIR "/docs/reference/";
  if (std::getenv("LOOPWARDEN_REGENERATE") != nullptr) {
    tests::write_file(folder + "modbus-map.md", map_markdown());
    tests::write_file(folder + "modbus-map.csv", map_csv({}));
  }
  INFO(
      "to bring the files up to date: LOOPWARDEN_REGENERATE=1 bin/tests_workbench "
      "'[register_map]'");
  CHECK((tests::read_file(folder + "modbus-map.md") == map_markdown()));
  CHECK((tests::read_file(folder + "modbus-map.csv") == map_csv({})));
}

TEST_CASE("every register of every loop is in each list", "[register_map]") {
  const MapOptions options{.loops = {"FIC-101", "FIC-102", "FIC-103"}};
  const std::size_t all = registers_of(3);
  CHECK(count(map_csv(options), "\n") == all + 1);
  CHECK(count(map_mbpoll(options), "\nread_one ") == all);
  CHECK(count(map_javascript(options), "\n  [\"") == all);
  CHECK(count(map_pymodbus(options), "\n    (\"") == all);
  CHECK(count(map_telegraf(options), "{ register = ") == all);
  CHECK(count(node_of(map_node_red(options), "lw-decode").at("func"), "],[") == all - 1);
}

TEST_CASE("an address is written as each master counts it", "[register_map]") {
  const MapOptions options{
      .host = "10.0.0.9", .port = 502, .unit = 7, .loops = {"FIC-101", "FIC-102"}};
  CHECK(map_csv(options).find("input register,136,300137,FIC-102,pv,f32,2,1,PV,r,") !=
        std::string::npos);
  CHECK(map_csv(options).find("holding register,34,400035,FIC-101,sp,f32,2,1,PV,rw,") !=
        std::string::npos);
  CHECK(map_mbpoll(options).find(
            "\nread_one 'input register:FIC-102.pv' f32 1 -t 3:float -r 136 -B\n") !=
        std::string::npos);
  CHECK(map_mbpoll(options).find("host=${1:-10.0.0.9} port=${2:-502}") != std::string::npos);
  CHECK(map_mbpoll(options).find("-a 7 ") != std::string::npos);
  CHECK(map_javascript(options).find(
            "\n  [\"input register\", 136, 2, \"f32\", 1, \"FIC-102.pv\"],\n") !=
        std::string::npos);
  // Node-RED reads the second and third blocks as well.
  CHECK(map_node_red(options).find(R"("adr": "57352")") != std::string::npos);
  CHECK(map_node_red(options).find(R"("adr": "32800")") != std::string::npos);
  CHECK(map_csv(options).find("holding register,32804,432805,FIC-102,compensator,f32,2,1,CO,r,") !=
        std::string::npos);
  CHECK(map_telegraf(options).find(
            R"({ register = "input", address = 136, name = "pv", type = "FLOAT32" })") !=
        std::string::npos);
  CHECK(map_telegraf(options).find(
            R"({ register = "holding", address = 34, name = "set_sp", type = "FLOAT32" })") !=
        std::string::npos);
  CHECK(map_telegraf(options).find("[inputs.modbus.metric.tags]\n      loop = \"FIC-102\"\n") !=
        std::string::npos);
}

TEST_CASE(
    "a Node-RED flow is on one tab, with separate places for its nodes and wires only between them",
    "[register_map]") {
  const std::string text = map_node_red({.loops = {"FIC-101", "FIC-102"}});
  const nlohmann::json flow = nlohmann::json::parse(text);
  std::set<std::string> ids;
  std::set<std::pair<int, int>> places;
  for (const nlohmann::json& node : flow) CHECK(ids.insert(node.at("id")).second);
  for (const nlohmann::json& node : flow) {
    if (node.at("type") == "tab" || node.at("type") == "modbus-client") continue;
    INFO(node.dump());
    CHECK(node.at("z") == "lw-tab");
    CHECK(places.emplace(node.at("x"), node.at("y")).second);
    for (const nlohmann::json& output : node.at("wires")) {
      for (const nlohmann::json& to : output) CHECK(ids.contains(to));
    }
    if (node.contains("server")) CHECK(ids.contains(node.at("server")));
  }
  CHECK(node_of(text, "lw-order")
            .at("func")
            .get<std::string>()
            .find(R"("FIC-102/sp":[16,66,"f32",1.0])") != std::string::npos);
  CHECK(node_of(text, "lw-sp-1").at("topic") == "FIC-102/sp");
  CHECK(node_of(text, "lw-sp-1").at("payload") ==
        R"($lookup($lookup($flowContext("loopwarden"), "FIC-102"), "set/sp"))");
}

TEST_CASE("a tag can contain special characters of a shell", "[register_map]") {
  CHECK(map_mbpoll({.loops = {"a'b"}}).find(R"('input register:a'\''b.pv')") != std::string::npos);
}

TEST_CASE("the word order is used in every list", "[register_map]") {
  using hal::modbus::ByteOrder;
  MapOptions options;
  options.word_order = ByteOrder::cdab;
  CHECK(map_mbpoll(options).find(" -B\n") == std::string::npos);
  CHECK(map_javascript(options).find("WORD_ORDER = \"cdab\"") != std::string::npos);
  CHECK(map_pymodbus(options).find("WORDS_REVERSED, BYTES_SWAPPED = True, False") !=
        std::string::npos);
  CHECK(map_telegraf(options).find("\"CDAB\"") != std::string::npos);
  CHECK(map_node_red(options).find(R"(order = \"cdab\")") != std::string::npos);
  options.word_order = ByteOrder::badc;
  CHECK(map_pymodbus(options).find("WORDS_REVERSED, BYTES_SWAPPED = False, True") !=
        std::string::npos);
  // mbpoll would misread this register, so it is left out.
  CHECK(map_mbpoll(options).find(":float") == std::string::npos);
  CHECK(map_mbpoll(options).find("left out") != std::string::npos);
}

}  // namespace register_map_test
