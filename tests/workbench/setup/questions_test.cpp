// SPDX-License-Identifier: Apache-2.0
#include "workbench/setup/questions.hpp"

#include <catch2/catch.hpp>
#include <string>

#include "tests/support/property.hpp"

namespace loopwarden::workbench::setup::questions_test {

TEST_CASE("the description of a register gives a place, or no register", "[setup]") {
  const auto place = register_in("2 Holding 100 F32 cdab");
  REQUIRE(place);
  CHECK(place->unit == 2);
  CHECK(place->table == "holding");
  CHECK(place->address == 100);
  CHECK(place->type == "f32");
  CHECK(place->order == "cdab");
  CHECK(register_in("1 input 0 u16")->order == "abcd");
  for (const char* text :
       {"", "1 input 0", "1 coil 0 u16", "1 input 65536 u16", "256 input 0 u16", "1 input -1 u16",
        "1 input 0 u8", "1 input 0 u16 dcab", "1 input 0 u16 abcd more", "1 input 0x10 u16"}) {
    INFO(text);
    CHECK_FALSE(register_in(text));
  }
}

TEST_CASE("exactly the typed units are used", "[setup]") {
  CHECK(units_in("1-3,7 9") == std::vector<unsigned>{1, 2, 3, 7, 9});
  CHECK(units_in("255") == std::vector<unsigned>{255});
  for (const char* text : {"", "256", "3-1", "1-", "-3", "1-300", "x"}) {
    INFO(text);
    CHECK_FALSE(units_in(text));
  }
}

TEST_CASE("43 % is a share of the range, a number is a value", "[setup]") {
  CHECK(said_value("43 %", {0.0, 25.0}) == Approx(10.75));
  CHECK(said_value("50%", {-10.0, 10.0}) == Approx(0.0));
  CHECK(said_value("10.75", {0.0, 25.0}) == Approx(10.75));
  CHECK_FALSE(said_value("about 43 %", {0.0, 25.0}));
  CHECK_FALSE(said_value("nan", {0.0, 25.0}));
  CHECK_FALSE(said_value("%", {0.0, 25.0}));
}

TEST_CASE("each question accepts the answer that it offers, and refuses nonsense", "[setup]") {
  for (const std::string& id : question_ids()) {
    INFO(id);
    const Question& q = question(id);
    // An example in the question is a valid answer, and CO's is a register that can be written.
    const std::size_t example = q.text.find("such as 1 ");
    if (id.ends_with(".register") && example != std::string::npos) {
      const auto place = register_in(std::string(q.text.substr(example + 8)));
      REQUIRE(place);
      CHECK(place->table == (id == "co.register" ? "holding" : "input"));
    }
    if (q.fallback != nullptr) CHECK(q.wrong(q.fallback).empty());
    if (id != "description" && id != "pv.unit" && id != "co.unit" && !id.starts_with("opcua") &&
        id != "link.hosts" && id != "link.host" && id != "link.device") {
      CHECK_FALSE(q.wrong("no such ! thing").empty());
    }
  }
  CHECK_FALSE(question("tag").wrong("../x").empty());
  CHECK_FALSE(question("pv.range").wrong("25 0").empty());
  CHECK_FALSE(question("pv.scale").wrong("5 5 0 100").empty());
  CHECK_FALSE(question("comm_loss.register").wrong("1 input 0 u16").empty());
}

TEST_CASE("a unit is dropped only after a number", "[setup]") {
  CHECK(without_unit("5.0 m3/h", "m3/h") == "5.0");
  CHECK(without_unit("5m3/h, 8 M3/H", "m3/h") == "5, 8");
  CHECK(without_unit("20 % 80 %", "%") == "20  80");
  CHECK(without_unit("m3/h", "m3/h") == "m3/h");
  CHECK(without_unit("5 mm", "m") == "5 mm");
  CHECK(without_unit("hold", "h") == "hold");
  CHECK(without_unit("5 bar", "m3/h") == "5 bar");
  CHECK(said_value("5.0 m3/h", {0.0, 25.0}, "m3/h") == 5.0);
  CHECK(said_value("50 %", {0.0, 25.0}, "m3/h") == 12.5);
  CHECK_FALSE(said_value("5 bar", {0.0, 25.0}, "m3/h"));
  // For any typed text, numbers stay unchanged.
  tests::property::for_all("units behind numbers", 300, [] {
    const double number = tests::property::number(-1e6, 1e6);
    std::string unit;
    for (auto left = tests::property::integer(0, 5); left > 0; --left) {
      unit += "abm%/ 3"[tests::property::integer(0, 6)];
    }
    const std::string text = std::to_string(number);
    const auto read = numbers_in(without_unit(text + " " + unit, unit), 1);
    if (read) tests::property::require(read->front() == std::stod(text), "another number");
  });
}

}  // namespace loopwarden::workbench::setup::questions_test
