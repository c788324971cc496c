// SPDX-License-Identifier: Apache-2.0
#include "workbench/text/register_map_text.hpp"

#include <catch2/catch.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>

#include "map/register_map.hpp"
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
  for (const register_map::Register& reg : register_map::registers()) {
    all += reg.area == register_map::Area::box ? 1 : loops;
  }
  return all;
}

}  // namespace

TEST_CASE("docs/modbus-map.md and .csv say what the table says", "[register_map]") {
  const std::string folder = LOOPWARDEN_SOURCE_DIR "/docs/";
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
  CHECK(count(map_mbpoll(options), "\nmbpoll ") == all);
  CHECK(count(map_pymodbus(options), "\n    (\"") == all);
  CHECK(count(map_telegraf(options), "{ name = ") == all);
  CHECK(count(map_ignition(options), "\n") == all + 2);
  const nlohmann::json flow = nlohmann::json::parse(map_node_red(options));
  CHECK(count(flow[1].at("func").get<std::string>(), "\"address\"") == all);
}

TEST_CASE("an address is written as each master counts", "[register_map]") {
  const MapOptions options{
      .host = "10.0.0.9", .port = 502, .unit = 7, .loops = {"FIC-101", "FIC-102"}};
  CHECK(map_csv(options).find("input register,136,300137,FIC-102,pv,f32,2,1,PV,r,") !=
        std::string::npos);
  CHECK(map_csv(options).find("holding register,34,400035,FIC-101,sp,f32,2,1,PV,rw,") !=
        std::string::npos);
  CHECK(map_mbpoll(options).find(
            "-0 -B -m tcp -p 502 -a 7 -t 3:float -r 136 -c 1 10.0.0.9  # FIC-102.pv\n") !=
        std::string::npos);
  // Node-red fetches the second blocks as well.
  CHECK(map_node_red(options).find(R"("adr": 57352)") != std::string::npos);
  CHECK(map_node_red(options).find(R"("adr": 32800)") != std::string::npos);
  CHECK(map_csv(options).find("holding register,32804,432805,FIC-102,compensator,f32,2,1,CO,r,") !=
        std::string::npos);
  CHECK(map_ignition(options).find("FIC-102.pv,[loopwarden]7.IRF137,1,PV") != std::string::npos);
  CHECK(map_telegraf(options).find(
            R"({ name = "FIC_102_pv", byte_order = "ABCD", )"
            R"(data_type = "FLOAT32-IEEE", scale = 1, address = [136, 137] })") !=
        std::string::npos);
}

TEST_CASE("the word order reaches every list", "[register_map]") {
  using hal::modbus::ByteOrder;
  MapOptions options;
  options.word_order = ByteOrder::cdab;
  CHECK(map_mbpoll(options).find("-B") == map_mbpoll(options).find("-B is word order"));
  CHECK(map_pymodbus(options).find("WORDS_REVERSED, BYTES_SWAPPED = True, False") !=
        std::string::npos);
  CHECK(map_telegraf(options).find("\"CDAB\"") != std::string::npos);
  CHECK(map_node_red(options).find(R"(order = \"cdab\")") != std::string::npos);
  options.word_order = ByteOrder::badc;
  CHECK(map_pymodbus(options).find("WORDS_REVERSED, BYTES_SWAPPED = False, True") !=
        std::string::npos);
  // mbpoll can't read it: what it would misread is left out.
  CHECK(map_mbpoll(options).find("float") == std::string::npos);
  CHECK(map_mbpoll(options).find("left out") != std::string::npos);
}

}  // namespace register_map_test
