// SPDX-License-Identifier: Apache-2.0
#include "config/map_reader.hpp"

#include <catch2/catch.hpp>
#include <functional>

namespace map_reader_test {

using namespace loopwarden::config;

namespace {

enum class Colour { red, green };
constexpr std::array kColours{Choice<Colour>{"red", Colour::red},
                              Choice<Colour>{"green", Colour::green}};

// Returns the messages while `read` reads `text`.
std::string said(const std::string& text, const std::function<void(MapReader&)>& read) {
  Report report("f");
  std::optional<YamlNode> root = parse_yaml(text, report);
  REQUIRE(root);
  MapReader in(*root, "", report);
  read(in);
  report_unknown_keys(*root, report);
  return to_text(report.take());
}

// Returns the messages for "x: <value>" if a number above 0 s is required.
std::string said_of_number(const std::string& value) {
  return said("x: " + value + "\n", [](MapReader& in) {
    const Value<double> x = in.need_number("x", {"s", above(0.0), ""});
    CHECK_FALSE(x.valid);
    CHECK(x.given);
  });
}

std::string said_of_integer(const std::string& value, bool hexadecimal = false) {
  return said("x: " + value + "\n", [&](MapReader& in) {
    CHECK_FALSE(in.need_integer("x", {0, 255, "", "", hexadecimal}).valid);
  });
}

}  // namespace

TEST_CASE("Numbers are read in every decimal notation", "[config]") {
  const auto [text, value] = GENERATE(table<const char*, double>({{"1", 1.0},
                                                                  {"+2.5", 2.5},
                                                                  {"-0.25", -0.25},
                                                                  {".5", 0.5},
                                                                  {"3.", 3.0},
                                                                  {"1e3", 1000.0},
                                                                  {"1.5E-3", 0.0015},
                                                                  {"0", 0.0},
                                                                  {"0.1", 0.1}}));
  const std::string messages = said(std::string("x: ") + text, [value = value](MapReader& in) {
    const Value<double> x = in.need_number("x", {"", any_number(), ""});
    CHECK(x.valid);
    CHECK(x.value == value);
    CHECK(x.place == Place{1, 4});
  });
  CHECK(messages.empty());
}

TEST_CASE("A value that is no number is described in the error", "[config]") {
  CHECK(said_of_number("0") == "f:1:4: error: x: must be > 0 s (got 0)\n");
  CHECK(said_of_number("-3") == "f:1:4: error: x: must be > 0 s (got -3)\n");
  CHECK(said_of_number("\"5\"") == "f:1:4: error: x: must be a number (got text in quotes, '5')\n");
  CHECK(said_of_number("5 s") ==
        "f:1:4: error: x: must be a number only, its unit is s (got '5 s')\n");
  CHECK(said_of_number("five") == "f:1:4: error: x: must be a number (got 'five')\n");
  CHECK(said_of_number(".inf") == "f:1:4: error: x: must be a finite number (got .inf)\n");
  CHECK(said_of_number("-INF") == "f:1:4: error: x: must be a finite number (got -INF)\n");
  CHECK(said_of_number(".NaN") == "f:1:4: error: x: must be a finite number (got .NaN)\n");
  CHECK(said_of_number("1e999") ==
        "f:1:4: error: x: is beyond what a number can hold (got 1e999)\n");
  CHECK(said_of_number("010") ==
        "f:1:4: error: x: must be a number without leading zeros, which some read as octal (got "
        "010)\n");
  CHECK(said_of_number("0x1F") ==
        "f:1:4: error: x: must be a number in decimal notation (got 0x1F)\n");
  CHECK(said_of_number("1,5") ==
        "f:1:4: error: x: must be a number only, its unit is s (got '1,5')\n");
  CHECK(said_of_number("1.2.3") ==
        "f:1:4: error: x: must be a number only, its unit is s (got '1.2.3')\n");
  CHECK(said_of_number("1e") ==
        "f:1:4: error: x: must be a number only, its unit is s (got '1e')\n");
  CHECK(said_of_number("'-'") == "f:1:4: error: x: must be a number (got text in quotes, '-')\n");
  CHECK(said_of_number("-.") == "f:1:4: error: x: must be a number (got '-.')\n");
  CHECK(said_of_number("[1]") == "f:1:4: error: x: must be a number (got a list)\n");
  CHECK(said_of_number("{a: 1}") == "f:1:4: error: x: must be a number (got a mapping)\n");
  CHECK(said_of_number("") == "f:1:1: error: x: must be a number (no value given)\n");
}

TEST_CASE("Ranges distinguish open from closed ends", "[config]") {
  CHECK(to_text(above(0.0)) == "> 0");
  CHECK(to_text(at_least(0.0)) == ">= 0");
  CHECK(to_text(between(0.5, 2.0)) == ">= 0.5 and <= 2");
  CHECK(to_text(any_number()).empty());
  CHECK_FALSE(above(0.0).contains(0.0));
  CHECK(at_least(0.0).contains(0.0));
  CHECK(between(0.0, 1.0).contains(1.0));
  CHECK_FALSE(Interval{.low = 0.0, .high = 1.0, .high_is_open = true}.contains(1.0));
}

TEST_CASE("Whole numbers keep to their range", "[config]") {
  CHECK(said_of_integer("256") ==
        "f:1:4: error: x: must be a whole number from 0 to 255 (got 256)\n");
  CHECK(said_of_integer("-1") ==
        "f:1:4: error: x: must be a whole number from 0 to 255 (got -1)\n");
  CHECK(said_of_integer("1.5") ==
        "f:1:4: error: x: must be a whole number from 0 to 255 (got 1.5)\n");
  CHECK(said_of_integer("99999999999999999999") ==
        "f:1:4: error: x: must be a whole number from 0 to 255 (got 99999999999999999999)\n");
  CHECK(said_of_integer("0x10") ==
        "f:1:4: error: x: must be a number in decimal notation (got 0x10)\n");
  CHECK(said_of_integer("0x100", true) ==
        "f:1:4: error: x: must be a whole number from 0 to 255 (got 0x100)\n");
  CHECK(said_of_integer("0xZZ", true) ==
        "f:1:4: error: x: must be a whole number from 0 to 255 (got 0xZZ)\n");
  CHECK(said("x: 0x1F\ny: 17\n", [](MapReader& in) {
          CHECK(in.need_integer("x", {0, 255, "", "", true}) == 31);
          CHECK(in.integer("y", {0, 255}, 3) == 17);
          CHECK(in.integer("z", {0, 255}, 3) == 3);
        }).empty());
}

TEST_CASE("Absent keys: required ones are named, others have their default", "[config]") {
  CHECK(said("a: 1\ninner: {a: 1}\n",
             [](MapReader& in) {
               in.need_number("a", {});
               const Value<double> b = in.number("b", {"s", at_least(0.0), ""}, 4.0);
               CHECK(b.value == 4.0);
               CHECK(b.valid);
               CHECK_FALSE(b.given);
               CHECK_FALSE(in.maybe_number("c", {}).given);
               CHECK_FALSE(in.need_number("d", {"s", above(0.0), ""}).valid);
               std::optional<MapReader> inner = in.need_section("inner", "");
               REQUIRE(inner);
               inner->need_number("a", {});
               CHECK_FALSE(inner->need_one_of("e", kColours, "").valid);
             }) ==
        "f:1:1: error: missing key 'd' (number > 0, s)\n"
        "f:2:8: error: missing key 'e' in 'inner' (red or green)\n");
}

TEST_CASE("Ranges of values and lists of points", "[config]") {
  const auto read = [](MapReader& in) { in.need_range("r", {"V", any_number(), ""}); };
  CHECK(said("r: [-1, 2.5]", [](MapReader& in) {
          const Value<std::pair<double, double>> r = in.need_range("r", {});
          CHECK(r.valid);
          CHECK(r.value == std::pair{-1.0, 2.5});
        }).empty());
  CHECK(said("r: [2, 2]", read) ==
        "f:1:4: error: r: must be [low, high] with low below high (got [2, 2])\n");
  CHECK(said("r: [3, 1]", read) ==
        "f:1:4: error: r: must be [low, high] with low below high (got [3, 1])\n");
  CHECK(said("r: [1, 2, 3]", read) == "f:1:4: error: r: must be [low, high], V\n");
  CHECK(said("r: 5", read) == "f:1:4: error: r: must be [low, high], V\n");
  CHECK(said("r: [1, x]", read) == "f:1:8: error: r: must be a number (got 'x')\n");

  CHECK(said("p: [[0, 1], [2, 3]]", [](MapReader& in) {
          CHECK(in.maybe_points("p", "[[x, y], ...]", "").value ==
                std::vector<std::pair<double, double>>{{0, 1}, {2, 3}});
        }).empty());
  CHECK(said("p: [[0, 1], 2, [3, a]]",
             [](MapReader& in) { CHECK_FALSE(in.maybe_points("p", "[[x, y], ...]", "").valid); }) ==
        "f:1:13: error: p: must be [[x, y], ...]\nf:1:20: error: p: must be a number (got 'a')\n");
}

TEST_CASE("Text, words, and true or false", "[config]") {
  CHECK(said("t: 'some text'\nw: green\nb: false\n", [](MapReader& in) {
          CHECK(in.need_text("t", "").value == "some text");
          CHECK(in.need_one_of("w", kColours, "").value == Colour::green);
          CHECK(in.flag("b", "", true).value == false);
          CHECK(in.one_of("absent", kColours, "", Colour::green).value == Colour::green);
          CHECK(in.text("none", "", "default").value == "default");
        }).empty());
  const auto read = [](MapReader& in) {
    in.need_text("t", "");
    in.need_one_of("w", kColours, "");
    in.flag("b", "", true);
  };
  CHECK(said("t: ''\nw: gren\nb: yes\n", read) ==
        "f:1:4: error: t: must be one line of 1 to 200 bytes (got '')\n"
        "f:2:4: error: w: must be red or green (got 'gren'); did you mean 'green'?\n"
        "f:3:4: error: b: must be true or false (got 'yes')\n");
  CHECK(said("t: |\n  two\n  lines\nw: [red]\nb: 'true'\n", read) ==
        "f:1:4: error: t: must be one line of 1 to 200 bytes (got 'two?lines?')\n"
        "f:4:4: error: w: must be red or green (got a list)\n"
        "f:5:4: error: b: must be true or false (got 'true')\n");
  CHECK(said("t: {a: 1}\nw:\nb: [true]\n", read) ==
        "f:1:4: error: t: must be a single value (got a mapping)\n"
        "f:2:1: error: w: must be red or green (got nothing)\n"
        "f:3:4: error: b: must be true or false (got a list)\n");
}

TEST_CASE("Mappings and lists within", "[config]") {
  const auto read = [](MapReader& in) {
    in.maybe_section("s", "");
    for (MapReader& item : in.maybe_list("l", "")) item.need_number("x", {});
    for (auto& [name, section] : in.maybe_named_sections("n", "name", "")) {
      section.need_number("x", {});
    }
  };
  CHECK(said("s: {}\nl: [{x: 1}, {x: 2}]\nn: {a: {x: 1}, b: {x: 2}}\n", read).empty());
  CHECK(said("s: 1\nl: {x: 1}\nn: [1]\n", read) ==
        "f:1:4: error: s: must be a mapping (got '1')\n"
        "f:2:4: error: l: must be a list (got a mapping)\n"
        "f:3:4: error: n: must be a mapping (got a list)\n");
  CHECK(said("l: [{x: a}, 5]\nn: {a: {y: 1}, b: 5}\n", read) ==
        "f:1:9: error: l[0].x: must be a number (got 'a')\n"
        "f:1:13: error: l[1]: must be a mapping, `key: value` (got a single value)\n"
        "f:2:8: error: missing key 'x' in 'n.a' (number)\n"
        "f:2:9: error: unknown key 'y'\n"
        "f:2:19: error: n.b: must be a mapping, `key: value` (got a single value)\n");
}

TEST_CASE("All errors of a mapping are reported in one pass", "[config]") {
  CHECK(said("a: x\nb: y\nd: 1\n",
             [](MapReader& in) {
               in.need_number("a", {});
               in.need_number("b", {});
               in.need_number("c", {});
             }) ==
        "f:1:1: error: missing key 'c' (number)\n"
        "f:1:4: error: a: must be a number (got 'x')\n"
        "f:2:4: error: b: must be a number (got 'y')\n"
        "f:3:1: error: unknown key 'd'\n");
}

TEST_CASE("The same calls describe the keys", "[config][reference]") {
  Report unused("");
  KeyReference reference;
  MapReader in(reference, "", unused);
  in.need_number("a", {"s", above(0.0), "first"});
  in.number("b", {"V", between(0.0, 1.0), "second"}, 0.5);
  in.one_of("c", kColours, "third", Colour::green);
  std::optional<MapReader> section = in.maybe_section("s", "fourth");
  REQUIRE(section);
  section->need_text("t", "fifth");
  in.number("b", {"", any_number(), "again"}, 1.0);
  REQUIRE(reference.keys().size() == 5);
  CHECK(reference.keys()[0].value == "number > 0, s");
  CHECK(reference.keys()[0].fallback == "required");
  CHECK(reference.keys()[1].value == "number >= 0 and <= 1, V");
  CHECK(reference.keys()[1].fallback == "0.5 V");
  CHECK(reference.keys()[1].meaning == "second");
  CHECK(reference.keys()[2].value == "red or green");
  CHECK(reference.keys()[2].fallback == "green");
  CHECK(reference.keys()[4].path == "s.t");
  CHECK_FALSE(unused.has_errors());
}

}  // namespace map_reader_test
