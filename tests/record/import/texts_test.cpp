// SPDX-License-Identifier: Apache-2.0
// Times, numbers, bad values, qualities and names in the forms of exports.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstdlib>
#include <string>
#include <utility>
#include <vector>

#include "model/numeric/random.hpp"
#include "record/import/decimal_marks.hpp"
#include "record/import/number_text.hpp"
#include "record/import/quality.hpp"
#include "record/import/tags.hpp"
#include "record/import/time_text.hpp"
#include "record/import/time_units.hpp"

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

TEST_CASE("one moment in all notations", "[import]") {
  for (const char* text :
       {"2026-03-01T10:00:00Z", "2026-03-01 10:00:00", "2026-03-01T11:00:00+01:00",
        "2026-03-01T11:00:00.000+0100", "2026/03/01 10:00", "20260301T100000Z",
        "2026-Mar-01 10:00:00", "2026-03-01 10:00:00 UTC", "2026-03-01 10:00:00 AM",
        "2026-03-01 11:00:00 CET"}) {
    CHECK(seconds(text, TimeForm::ymd) == 0.0);
  }
  // The native forms of Java, C and JavaScript, in any order of day and month.
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

TEST_CASE("texts that are no time", "[import]") {
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

TEST_CASE("day and month: the possible orders of a date, and text that reads back", "[import]") {
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
  for (const char* text : {"1,234.5", "1'234.5", "1 234.5", "1\u2019234.5", "1\u00a0234.5",
                           "1\u202f234.5", "1\u2009234.5", "1\u2007234.5"}) {
    INFO(text);
    CHECK(parse_number(text, '.') == 1234.5);
  }
  CHECK(parse_number("12,34,567.5", '.') == 1234567.5);  // as in India
  CHECK(parse_number("1,23,456", '.') == 123456.0);
  CHECK(parse_number("\u22121.234,5", ',') == -1234.5);
  for (const char* none : {"1,2345", "1,23,45", "123,45,678", ",123", "1,234,56", "1 234'567"}) {
    INFO(none);
    CHECK_FALSE(parse_number(none, '.'));
  }
  CHECK_FALSE(parse_number("1.5.2", '.'));
  CHECK_FALSE(parse_number("inf", '.'));
  CHECK_FALSE(parse_number("12 m", '.'));
}

// Short numbers are read by a faster method, which must give the same result.
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

TEST_CASE("bad values by name, doubtful ones, and unknown words", "[import]") {
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

// Returns one letter per cell for its state: g (good), q (questionable), b (bad).
std::string qualities(QualityKind kind, const std::vector<std::string>& cells,
                      std::vector<std::string>* said = nullptr) {
  QualityCells all(kind);
  std::vector<QualityCells::Id> ids;
  for (const std::string& cell : cells) ids.push_back(all.add(cell));
  const std::vector<std::string> remarks = all.settle();
  if (said != nullptr) *said = remarks;
  std::string letters;
  for (const QualityCells::Id id : ids) {
    const SampleQuality q = all.quality(id);
    letters += q == SampleQuality::good ? 'g' : q == SampleQuality::bad ? 'b' : 'q';
  }
  return letters;
}

TEST_CASE("qualities in the codes of many vendors", "[import]") {
  const QualityKind state = quality_kind("Quality");
  CHECK(qualities(state, {"192", "216", "64", "0", "24", "0xC0", ""}) == "ggqbbgg");   // OPC DA
  CHECK(qualities(state, {"0", "0x80000000", "0x40000000", "0x00000000"}) == "gbqg");  // OPC UA
  CHECK(qualities(state, {"0", "2147483648", "1083179008", "-2147483648"}) == "gbqb");
  CHECK(qualities(state, {"0", "0"}) == "gg");
  CHECK(qualities(state, {"128", "128", "76", "0", "24"}) == "ggqbb");  // Siemens
  CHECK(qualities(state, {"0", "0", "1", "133"}) == "ggbq");            // AVEVA
  CHECK(qualities(quality_kind("QualityDetail"), {"192", "192", "24", "65"}) == "ggbq");
  CHECK(qualities(quality_kind("IQuality"), {"3", "3", "65472", "0"}) == "ggbb");  // eWON
  CHECK(qualities(state, {"3", "3", "3", "65472"}) == "gggb");
  CHECK(qualities(state, {"192", "256", "500", "512"}) == "gqqb");
  CHECK(qualities(state, {"192", "256", "512", "Good (192)", "Bad_Stale"}) == "gqbgb");  // Ignition
  CHECK(qualities(quality_kind("Confidence"), {"100", "0", "50"}) == "gbq");             // PHD
  CHECK(qualities(quality_kind("Validity"), {"1", "1", "0"}) == "ggb");                  // WinCC
  CHECK(qualities(quality_kind("Questionable"), {"False", "True", "0", "1"}) == "gqgq");  // PI
  CHECK(qualities(quality_kind("IsBad"), {"0", "1", "no", "yes"}) == "gbgb");
  std::vector<std::string> said;
  // If nearly all cells have one state, it means good. Otherwise a Status column is no quality.
  for (const auto& [usual, odd] : {std::pair{"0", "1"}, {"NR", "BAD"}, {"0x80", "0x18"}}) {
    INFO(usual);
    std::vector<std::string> cells(12, usual);
    cells.emplace_back(odd);
    CHECK(qualities(quality_kind("Status"), cells, &said) == "ggggggggggggb");
    const bool of_value = std::string(odd) == "BAD";
    CHECK(qualities(quality_kind("Status"), {usual, usual, odd, odd}, &said) ==
          (of_value ? "bbbb" : "gggg"));
    CHECK(said.size() == 1);
  }
  std::vector<std::string> steps(12, "0");
  steps.emplace_back("3");
  CHECK(qualities(quality_kind("State"), steps) == "ggggggggggggg");
  CHECK(qualities(quality_kind("Status"), {"Normal", "Hi alarm"}) == "gg");  // of an alarm
  CHECK(qualities(quality_kind("Status"), {"OK", "Wartung"}) == "gb");
  CHECK(qualities(state, {"97,3", "97,4", "97,6"}) == "ggg");  // of a product
}

TEST_CASE("names of qualities with letters of types and marks", "[import]") {
  for (const char* good : {"bValid", "xGood", "Good?", "Quality OK"})
    CHECK(quality_kind(good) == QualityKind::good_flag);
  for (const char* state : {"Qualit\u00e4tscode", "DataIntegrity", "sQuality"})
    CHECK(quality_kind(state) == QualityKind::state);
  CHECK(quality_kind("iStatus") == QualityKind::status);
  CHECK(quality_kind("FIC1.PV") == QualityKind::none);
}

TEST_CASE("qualities in words of many languages, and unknown words", "[import]") {
  for (const char* good : {"Good",
                           "good",
                           "OK",
                           "Good, clamped",
                           "GoodLocalOverride",
                           "Good_Unspecified",
                           "gut",
                           "G\u00fcltig",
                           "bon",
                           "Valide",
                           "Bueno",
                           "v\u00e1lido",
                           "buona",
                           "goed",
                           "\u826f\u597d",
                           "\u6b63\u5e38",
                           "\u0425\u043e\u0440\u043e\u0448\u0435\u0435",
                           "No Error",
                           "Valid",
                           "true",
                           "192 - Good",
                           "0x00000000 (Good)"}) {
    INFO(good);
    CHECK(qualities(QualityKind::state, {good, "Bad"}) == "gb");
  }
  for (const char* bad : {"Bad",
                          "Bad Input",
                          "BadNoCommunication",
                          "Not Good",
                          "Invalid",
                          "I/O Timeout",
                          "No Data",
                          "Comm Fail",
                          "schlecht",
                          "Ung\u00fcltig",
                          "Gest\u00f6rt",
                          "mauvais",
                          "invalide",
                          "malo",
                          "no v\u00e1lido",
                          "\u574f",
                          "\u65e0\u6548",
                          "false",
                          "Validation failed",
                          "Scan Off"}) {
    INFO(bad);
    CHECK(qualities(QualityKind::state, {"Good", bad}) == "gb");
  }
  for (const char* doubt :
       {"Uncertain", "Questionable", "UncertainLastUsableValue", "unsicher", "Suspect", "incertain",
        "dudoso", "\u4e0d\u786e\u5b9a", "Substituted"}) {
    INFO(doubt);
    CHECK(qualities(QualityKind::state, {"Good", doubt}) == "gq");
  }
  std::vector<std::string> said;
  CHECK(qualities(QualityKind::state, {"Good", "Wartung", "Good", "Wartung"}, &said) == "gbgb");
  CHECK(said == std::vector<std::string>{"'Wartung' in 2 cells: not known, taken as bad"});
  CHECK(qualities(QualityKind::state, {"Xo", "Xo", "Xo", "Na"}, &said) == "gggb");
  REQUIRE(said.size() == 2);
  CHECK(said.front() == "'Xo' in 3 cells: not known, taken as good because most cells have it");
}

TEST_CASE("units after numbers and names", "[import]") {
  for (const auto& [text, unit] : {std::pair{"12.51 \u00b0C", "\u00b0C"},
                                   {"45%", "%"},
                                   {"45\u00a0%", "%"},
                                   {"1,234.5 kg/h", "kg/h"},
                                   {"-3.2 bar", "bar"},
                                   {"7 inH2O", "inH2O"},
                                   {"1e3 Nm\u00b3/h", "Nm\u00b3/h"}}) {
    INFO(text);
    const CellValue cell = parse_value(text, '.', {});
    CHECK(cell.cell == Cell::number);
    CHECK(cell.unit == unit);
  }
  CHECK(parse_value("3,2 bar", ',', {}).value == 3.2);
  for (const char* none : {"12 Wartung", "12 3", "bar", "FIC 12", "12..5 bar"})
    CHECK(parse_value(none, '.', {}).cell == Cell::unknown);
  const TagName tag = read_tag("FIC-40B/PID1/PV.CV GPM");
  CHECK(tag.loop == "FIC-40B/PID1");
  CHECK(tag.role == Role::pv);
  CHECK(tag.unit == "GPM");
  CHECK(read_tag("LIC-40A/PID1/OUT.CV %").role == Role::co);
  CHECK(read_tag("LIC-40A/PID1/SP.CV inH2O").unit == "inH2O");
  CHECK(read_tag("TIC1.PV deg C").role == Role::pv);
  CHECK(read_tag("TIC1.PV No EngUnits").role == Role::pv);
  CHECK(read_tag("FIC101.PV mV").unit == "mV");
  CHECK(read_tag("FIC101 MV").role == Role::co);
  CHECK_FALSE(read_tag("FIC101.PV Quality").role);
}

TEST_CASE("marks before three digits are ambiguous, others are not", "[import]") {
  for (const auto& [text, marks] : {std::pair{"1.045", Marks::point_open},
                                    {"-12,500", Marks::comma_open},
                                    {"0,123", Marks::comma_decimal},
                                    {"1.04", Marks::point_decimal},
                                    {"1234,567", Marks::comma_decimal},
                                    {"1,234.567", Marks::point_decimal},
                                    {"1.234,567", Marks::comma_decimal},
                                    {"1,234,567", Marks::point_decimal},
                                    {"1,23,456", Marks::point_decimal},
                                    {"1 234,567", Marks::comma_decimal},
                                    {"1'234.567", Marks::point_decimal},
                                    {"1.5e3", Marks::point_decimal},
                                    {"896", Marks::whole},
                                    {"1 045", Marks::whole},
                                    {"Bad", Marks::none}}) {
    INFO(text);
    CHECK(marks_of(text) == marks);
  }
  const auto by_jumps = [](std::initializer_list<const char*> cells) {
    MarkEvidence evidence;
    for (const char* cell : cells) evidence.add(cell);
    return evidence.by_jumps();
  };
  CHECK(by_jumps({"896", "1,045", "1,101", "998"}) == '.');
  CHECK(by_jumps({"896", "1.045", "998"}) == ',');
  CHECK(by_jumps({"2", "1,998", "2,002", "2"}) == ',');
  CHECK(by_jumps({"12", "1,045"}) == '\0');
  CHECK(by_jumps({"1,045", "1,046"}) == '\0');
  CHECK(by_jumps({"0", "1,045"}) == '\0');
}

TEST_CASE("the name of a column of times gives its unit", "[import]") {
  for (const auto& [name, form] : {std::pair{"time_ms", TimeForm::milliseconds},
                                   {"t[ms]", TimeForm::milliseconds},
                                   {"Time (ms)", TimeForm::milliseconds},
                                   {"Time in ms", TimeForm::milliseconds},
                                   {"TimeMs", TimeForm::milliseconds},
                                   {"millis", TimeForm::milliseconds},
                                   {"elapsed_msec", TimeForm::milliseconds},
                                   {"Zeit [ms]", TimeForm::milliseconds},
                                   {"timestamp_us", TimeForm::microseconds},
                                   {"t (\u00b5s)", TimeForm::microseconds},
                                   {"micros", TimeForm::microseconds},
                                   {"time_ns", TimeForm::nanoseconds},
                                   {"time_s", TimeForm::seconds},
                                   {"Time (min)", TimeForm::minutes},
                                   {"t_h", TimeForm::hours},
                                   {"time", TimeForm::automatic},
                                   {"timestamp", TimeForm::automatic},
                                   {"Timestamps", TimeForm::automatic}}) {
    INFO(name);
    CHECK(time_unit_of(name) == form);
    CHECK(is_time_name(name));
  }
  for (const char* name : {"std", "min", "us_gallons", "PV ms", "mass", "stem"})
    CHECK_FALSE(is_time_name(name));
  const auto counted = [](const char* name, double from, double step) {
    std::vector<double> times;
    for (int k = 0; k < 50; ++k) times.push_back(from + step * k);
    return count_times(name, times);
  };
  CHECK(counted("time_ms", 87754496.0, 1000.0).form == TimeForm::milliseconds);
  CHECK(counted("time_ms", 1.79e12, 1000.0).form == TimeForm::epoch_ms);
  CHECK(counted("timestamp_us", 1.79e15, 1e6).form == TimeForm::epoch_us);
  CHECK(counted("time", 1.79e9, 1.0).form == TimeForm::epoch_s);
  CHECK(counted("time", 0.0, 1000.0).question.find("--time milliseconds (1 s)") !=
        std::string::npos);
  CHECK(counted("time", 0.0, 100.0).question.find("--time seconds (100 s)") != std::string::npos);
  CHECK(counted("time", 5.0, 1e6).question.find("--time microseconds (1 s)") != std::string::npos);
  for (const double step : {0.001, 1.0, 5.0, 10.0, 60.0, 120.0, 300.0, 600.0, 900.0, 3600.0, 137.0})
    CHECK(counted("time", 0.0, step).question.empty());
  CHECK(counted("time_s", 0.0, 1000.0).question.empty());
}

TEST_CASE("the loop and the signal of a name", "[import]") {
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
