// SPDX-License-Identifier: Apache-2.0
// Times, numbers, bad values, qualities and names, as exports have them.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <string>

#include "model/numeric/random.hpp"
#include "record/import/number_text.hpp"
#include "record/import/tags.hpp"
#include "record/import/time_text.hpp"

namespace loopwarden::tests::texts_test {
namespace {

using namespace loopwarden::record;

// `date -ud 2026-03-01T10:00:00Z +%s`
constexpr std::int64_t kTen = 1772359200;

double seconds(const char* text, TimeForm form) {
  const auto time = parse_time(text, form);
  INFO(text);
  REQUIRE(time);
  return static_cast<double>(time->whole_s - kTen) + time->rest_s;
}

TEST_CASE("one moment in all the ways in which it is written", "[import]") {
  for (const char* text :
       {"2026-03-01T10:00:00Z", "2026-03-01 10:00:00", "2026-03-01T11:00:00+01:00",
        "2026-03-01T11:00:00.000+0100", "2026/03/01 10:00", "20260301T100000Z",
        "2026-Mar-01 10:00:00", "2026-03-01 10:00:00 UTC", "2026-03-01 10:00:00 AM",
        "2026-03-01 11:00:00 CET"}) {
    CHECK(seconds(text, TimeForm::ymd) == 0.0);
  }
  // Java's, C's and JavaScript's own, whatever the order of numbers is.
  for (const TimeForm form : {TimeForm::ymd, TimeForm::dmy, TimeForm::mdy}) {
    for (const char* text :
         {"Sun Mar 01 11:00:00 CET 2026", "Sun Mar 01 12:00:00 MESZ 2026",
          "Sun Mar 01 05:00:00 EST 2026", "Sun Mar  1 10:00:00 2026",
          "Sun Mar 01 2026 11:00:00 GMT+0100 (Central European Standard Time)",
          "Sun, 01 Mar 2026 10:00:00 GMT", "Mar 1, 2026 10:00:00 AM", "So, 01-Mar-2026 10:00",
          "Sun Mar 01 12:00:00 GMT+02:00 2026", "Sun Mar 01 10:00:00 XYZ 2026"}) {
      CHECK(seconds(text, form) == 0.0);
    }
  }
  CHECK(parse_time("Sun Mar 01 11:00:00 CET 2026", TimeForm::ymd)->zone_known);
  CHECK_FALSE(parse_time("Sun Mar 01 10:00:00 XYZ 2026", TimeForm::ymd)->zone_known);
  for (const char* text : {"01.03.2026 10:00:00", "1/3/2026 10:00", "01-Mar-26 10:00:00",
                           "01-MAR-2026 10:00:00.000", "1.3.26 10:00"}) {
    CHECK(seconds(text, TimeForm::dmy) == 0.0);
  }
  for (const char* text : {"3/1/2026 10:00:00 AM", "03-01-2026 10:00", "01-Mar-26 10:00:00"}) {
    CHECK(seconds(text, TimeForm::mdy) == 0.0);
  }
  CHECK(seconds("3/1/2026 10:00:00 PM", TimeForm::mdy) == 43200.0);
  CHECK(seconds("3/1/2026 12:00:00 AM", TimeForm::mdy) == -36000.0);
  CHECK(seconds("2026-03-01T10:00:00.25", TimeForm::ymd) == 0.25);
  CHECK(seconds("2026-03-01 10:00:00,5", TimeForm::ymd) == 0.5);
  CHECK(seconds("1772359200.5", TimeForm::epoch_s) == 0.5);
  CHECK(seconds("1772359200500", TimeForm::epoch_ms) == 0.5);
  CHECK(seconds("1772359200000000500", TimeForm::epoch_ns) < 1e-3);
  CHECK(seconds("46082.4166666667", TimeForm::excel) == 0.0);
}

TEST_CASE("what is no time", "[import]") {
  for (const char* text :
       {"", "2026-13-01", "2026-02-30 10:00", "2026-03-01 25:00", "2026-03-01 10:61",
        "2026-03-01T10:00:00+99:00", "yesterday", "2026-03-01 10:00:00 XYZ", "Sun", "Mar",
        "Sun Mar", "Sun Mar 40 10:00:00 CET 2026", "Sun Mar 01 10:00:00 CET",
        "Sun Mar 01 10:00:00 CET 2026 x", "Mar 1 2026 10:00 (", "FIC 1 10:00:00 CET 2026"}) {
    INFO(text);
    CHECK_FALSE(parse_time(text, TimeForm::ymd));
  }
  CHECK_FALSE(parse_time("13/13/2026", TimeForm::dmy));
  CHECK(parse_time("2024-02-29", TimeForm::ymd));
  CHECK_FALSE(parse_time("2023-02-29", TimeForm::ymd));
  for (const TimeForm form : {TimeForm::minutes, TimeForm::hours, TimeForm::excel}) {
    CHECK_FALSE(parse_time("9e17", form));
    CHECK_FALSE(parse_time("-9e17", form));
  }
}

TEST_CASE("day and month: which orders a date can have, and text that reads back", "[import]") {
  CHECK((possible_orders("03/04/2026").dmy && possible_orders("03/04/2026").mdy));
  CHECK((possible_orders("13/04/2026").dmy && !possible_orders("13/04/2026").mdy));
  CHECK((!possible_orders("04/13/2026").dmy && possible_orders("04/13/2026").mdy));
  CHECK(iso_text(kTen, 0.0, true) == "2026-03-01T10:00:00Z");
  CHECK(iso_text(kTen, 0.25, false) == "2026-03-01T10:00:00.250");
  CHECK(iso_text(-1, 0.0, true) == "1969-12-31T23:59:59Z");
  CHECK(zone_offset_s("+01:00") == 3600);
  CHECK(zone_offset_s("utc") == 0);
  CHECK_FALSE(zone_offset_s("berlin"));
}

TEST_CASE("numbers with point, comma and thousands", "[import]") {
  CHECK(parse_number("1.5", '.') == 1.5);
  CHECK(parse_number("+1.5e3", '.') == 1500.0);
  CHECK(parse_number("1,5", ',') == 1.5);
  CHECK(parse_number("-1.234,5", ',') == -1234.5);
  CHECK(parse_number("1,234,567.5", '.') == 1234567.5);
  CHECK(parse_number("1'234.5", '.') == 1234.5);
  CHECK_FALSE(parse_number("1,5", '.'));
  CHECK_FALSE(parse_number("12,34,567", '.'));
  CHECK_FALSE(parse_number("1.5.2", '.'));
  CHECK_FALSE(parse_number("inf", '.'));
  CHECK_FALSE(parse_number("12 m", '.'));
}

// Short ones are read by a shorter way, which must not be seen.
TEST_CASE("every number is the double nearest to its text", "[import]") {
  numeric::Random random(3);
  for (int k = 0; k < 20000; ++k) {
    const auto decimals = static_cast<int>(8.0 * random.uniform());
    const double size = std::pow(10.0, 12.0 * random.uniform() - 3.0);
    const std::string text = fmt::format("{:.{}f}", size * random.normal(), decimals);
    const double nearest = std::strtod(text.c_str(), nullptr);
    INFO(text);
    REQUIRE(parse_number(text, '.') == nearest);
    std::string comma = text;
    std::replace(comma.begin(), comma.end(), '.', ',');
    REQUIRE(parse_number(comma, ',') == nearest);
  }
  CHECK(parse_number("-.5", '.') == -0.5);
  CHECK(parse_number("5.", '.') == 5.0);
  CHECK(std::signbit(*parse_number("-0.0", '.')));
  CHECK(parse_number("123456789012345678", '.') == 123456789012345678.0);
  for (const char* none : {".", "-", "+", "+-5", "--5", "-.", "1.2.3", " 5"}) {
    INFO(none);
    CHECK_FALSE(parse_number(none, '.'));
  }
}

TEST_CASE("bad values by name, doubtful ones, and what nobody knows", "[import]") {
  for (const char* text : {"Bad", "Bad Input", "No Data", "I/O Timeout", "NaN", "nan", "#N/A", "-",
                           "Pt Created", "Shutdown", "inf", "[-11059] No Good Data"}) {
    INFO(text);
    CHECK(parse_value(text, '.', {}).cell == Cell::bad);
  }
  CHECK(parse_value("Questionable", '.', {}).cell == Cell::questionable);
  CHECK(parse_value("12.5 ?", '.', {}).cell == Cell::questionable);
  CHECK(parse_value("", '.', {}).cell == Cell::empty);
  CHECK(parse_value("Wartung", '.', {}).cell == Cell::unknown);
  CHECK(parse_value("Wartung", '.', {"wartung"}).cell == Cell::bad);
  CHECK(parse_value("12.5", '.', {}).value == 12.5);
}

TEST_CASE("qualities in words, of OPC DA and of OPC UA", "[import]") {
  for (const char* good : {"Good", "good", "192", "216", "1", "100", "0xC0", ""}) {
    INFO(good);
    CHECK(parse_quality(good, false) == SampleQuality::good);
  }
  CHECK(parse_quality("64", false) == SampleQuality::questionable);
  CHECK(parse_quality("Uncertain", false) == SampleQuality::questionable);
  CHECK(parse_quality("0", false) == SampleQuality::bad);
  CHECK(parse_quality("0", true) == SampleQuality::good);
  CHECK(parse_quality("Bad", false) == SampleQuality::bad);
  CHECK(parse_quality("0x80000000", true) == SampleQuality::bad);
}

TEST_CASE("the loop and the signal that a name stands for", "[import]") {
  const auto is = [](const char* name, const char* loop, Role role) {
    const TagName tag = read_tag(name);
    INFO(name);
    CHECK(tag.loop == loop);
    CHECK(tag.role == role);
  };
  is("FIC101.PV", "FIC101", Role::pv);
  is("FIC101.OP", "FIC101", Role::co);
  is("FIC101_OUT", "FIC101", Role::co);
  is("/Area1/FIC101/SP", "/Area1/FIC101", Role::sp);
  is("ns=2;s=Area1.FIC101.MV", "Area1.FIC101", Role::co);
  is("\\\\server\\FIC101.OUT", "FIC101", Role::co);
  is("FIC101/PID1/PV.CV", "FIC101/PID1", Role::pv);
  is("FIC101 Process Value", "FIC101", Role::pv);
  is("pv", "", Role::pv);
  is("Controller Output (%)", "", Role::co);
  is("FIC101.SV", "FIC101", Role::sp);
  is("FIC101.MODE", "FIC101", Role::mode);
  is("MODE.ACTUAL", "", Role::mode);
  is("FIC-110/PID1/MODE.ACTUAL", "FIC-110/PID1", Role::mode);
  is("FIC-110/PID1/SP.CV", "FIC-110/PID1", Role::sp);
  is("FIC101.PV (m3/h)", "FIC101", Role::pv);
  CHECK(read_tag("FIC101.PV [m3/h]").unit == "m3/h");
  CHECK_FALSE(read_tag("TI205").role);
  CHECK_FALSE(read_tag("COMPRESSOR").role);
}

TEST_CASE("cells between delimiters, with quotes", "[import]") {
  LineCells cells;
  REQUIRE(cells.split("a; \"b;c\" ;\"d \"\"e\"\"\";", ';'));
  CHECK(std::vector<std::string>(cells.cells.begin(), cells.cells.end()) ==
        std::vector<std::string>{"a", "b;c", "d \"e\"", ""});
  std::size_t at = 0;
  CHECK_FALSE(cells.split("a,\"b", ',', &at));
  CHECK(at == 2);
}

}  // namespace
}  // namespace loopwarden::tests::texts_test
