// SPDX-License-Identifier: Apache-2.0
#include "record/record_csv.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <limits>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace record_csv_test {

using namespace loopwarden::record;
using loopwarden::numeric::missing;
using loopwarden::tests::read_file;
using loopwarden::tests::TemporaryFolder;
using loopwarden::tests::write_file;
namespace fs = std::filesystem;

namespace {

struct Failure {
  std::string what;
  std::size_t line = 0;
  std::size_t column = 0;
  RecordError::Kind kind = RecordError::Kind::data;
};

Failure failure_of(std::string_view text) {
  try {
    parse_record(text, "r.csv");
  } catch (const RecordError& error) {
    return {error.what(), error.line(), error.column(), error.kind()};
  }
  return {"no failure"};
}

}  // namespace

TEST_CASE("the mode column is understood in words and numbers, and never an error") {
  const Record record = parse_record(
      "time,pv,mode\n0,1,AUTO\n1,1,Man\n2,1,cas\n3,1,1\n4,1,0\n5,1,2\n6,1,\n7,1,startup\n8,1,1.0\n"
      "9,1,0.0\n10,1,3.0\n",
      "r.csv");
  REQUIRE(!record.automatic.empty());
  CHECK(std::vector<double>(record.automatic.begin(), record.automatic.begin() + 6) ==
        std::vector<double>{1.0, 0.0, 1.0, 1.0, 0.0, 0.0});
  CHECK(std::isnan(record.automatic[6]));
  CHECK(std::isnan(record.automatic[7]));
  // The form in which programs write whole numbers of a column with gaps.
  CHECK(record.automatic[8] == 1.0);
  CHECK(record.automatic[9] == 0.0);
  CHECK(std::isnan(record.automatic[10]));
  CHECK_THROWS_WITH(parse_record("time,pv,mode,mode\n0,1,1,1\n1,2,1,1\n", "r.csv"),
                    Catch::Contains("column 'mode' appears twice"));
  CHECK(parse_record("time,pv\n0,1\n1,2\n", "r.csv").automatic.empty());
}

TEST_CASE("columns are found by name, in any order, others ignored") {
  const Record record = parse_record(
      "stem,comment,pv,time,co,sp\n"
      "40,start,5.5,10,50,6\n"
      "41,\"a, quoted \"\"b\"\"\",5.6,10.5,51,6\n"
      "42,,5.7,11,52,6\n",
      "r.csv");
  CHECK(record.time_s == std::vector<double>{10.0, 10.5, 11.0});
  CHECK(record.pv == std::vector<double>{5.5, 5.6, 5.7});
  CHECK(record.sp == std::vector<double>{6.0, 6.0, 6.0});
  CHECK(record.co == std::vector<double>{50.0, 51.0, 52.0});
  CHECK(record.stem == std::vector<double>{40.0, 41.0, 42.0});
  CHECK(!record.sp.empty());
  CHECK(!record.co.empty());
  CHECK(!record.stem.empty());
  CHECK(record.period_s == 0.5);
}

TEST_CASE("optional columns may be absent") {
  const Record record = parse_record("time,pv\n0,1\n1,2\n", "r.csv");
  CHECK(record.sp.empty());
  CHECK(record.co.empty());
  CHECK(record.stem.empty());
  CHECK(record.sp.empty());
  CHECK(record.size() == 2);
}

TEST_CASE("changes by spreadsheets are accepted: CRLF, byte order mark, quotes, blanks") {
  const Record record = parse_record(
      "\xEF\xBB\xBF\"time\" , \"pv\"\r\n 0 ,\t+1.5\r\n0.1,\"-2e-3\"\r\n0.2,.5\r\n\r\n  \r\n",
      "r.csv");
  CHECK(record.pv == std::vector<double>{1.5, -0.002, 0.5});
}

TEST_CASE("the last line needs no line end") {
  CHECK(parse_record("time,pv\n0,1\n1,2", "r.csv").pv == std::vector<double>{1.0, 2.0});
}

TEST_CASE("NaN in any case is a missing sample, and time can't be one") {
  const Record record = parse_record("time,pv,co\n0,NaN,1\n1,2,nan\n2,NAN,1\n", "r");
  CHECK(missing(record.pv) == 2);
  CHECK(missing(record.co) == 1);
  CHECK(record.pv[1] == 2.0);
  CHECK(std::isnan(record.pv[2]));
}

TEST_CASE("UTF-16 is named as such") {
  for (const std::string_view text :
       {std::string_view("\xFF\xFEt\0i\0m\0e\0", 10), std::string_view("\xFE\xFF\0t\0i", 6),
        std::string_view("t\0i\0m\0e\0", 8)}) {
    CHECK_THROWS_WITH(parse_record(text, "r.csv"), Catch::Contains("r.csv: is UTF-16"));
  }
}

TEST_CASE("empty cells are missing samples and are counted") {
  const Record record =
      parse_record("time,pv,sp,co,stem\n0,,1,1,1\n1,2,,1,1\n2,,1,,1\n3,5,1,1,\n4,,1,1,1\n", "r");
  CHECK(std::isnan(record.pv[0]));
  CHECK(record.pv[1] == 2.0);
  CHECK(std::isnan(record.sp[1]));
  CHECK(std::isnan(record.co[2]));
  CHECK(std::isnan(record.stem[3]));
  CHECK(missing(record.pv) == 3);
  CHECK(missing(record.sp) == 1);
  CHECK(missing(record.co) == 1);
  CHECK(missing(record.stem) == 1);
}

TEST_CASE("the period is the intended number") {
  std::string text = "time,pv\n";
  for (int i = 0; i < 4000; ++i) text += std::to_string(0.1 * i) + ",1\n";
  CHECK(parse_record(text, "r").period_s == 0.1);
  // UNIX time. A double resolves a quarter of a microsecond.
  CHECK(parse_record("time,pv\n1700000000.1,1\n1700000000.2,1\n1700000000.3,1\n", "r").period_s ==
        0.1);
  CHECK(parse_record("time,pv\n0,1\n3e-8,1\n6e-8,1\n", "r").period_s == Approx(3e-8));
}

TEST_CASE("a step within 1 % of the period passes, a larger one names its row") {
  CHECK_NOTHROW(parse_record("time,pv\n0,1\n1,1\n2,1\n3.009,1\n4.009,1\n", "r"));
  const Failure failure = failure_of("time,pv\n0,1\n1,1\n2,1\n3.011,1\n4.011,1\n");
  CHECK(failure.line == 5);
  CHECK_THAT(failure.what, Catch::StartsWith("r.csv:5: time: a step of 1.011 s to row 4"));
  CHECK(failure_of("time,pv\n0,1\n1,1\n3,1\n4,1\n5,1\n").line == 4);
}

TEST_CASE("time must rise") {
  const Failure back = failure_of("pv,time\n1,0\n1,1\n1,0.5\n");
  CHECK(back.line == 4);
  CHECK(back.column == 3);
  CHECK_THAT(back.what, Catch::Contains("0.5 s is not later than the 1 s"));
  CHECK(failure_of("time,pv\n0,1\n1,1\n1,1\n").line == 4);
}

TEST_CASE("errors are reported with line and column") {
  struct Case {
    const char* text;
    std::size_t line;
    std::size_t column;
    const char* what;
  };
  const Case cases[] = {
      {"", 0, 0, "empty"},
      {" \r\n\n", 0, 0, "empty"},
      {"\xEF\xBB\xBF", 0, 0, "empty"},
      {"time,pv\n", 0, 0, "0 rows"},
      {"time,pv\n0,1\n", 0, 0, "1 rows"},
      {"time,pv\n0,1\n1,abc\n", 3, 3, "pv: 'abc' is not a number"},
      {"time,pv\n0,1\n1,1.2.3\n", 3, 3, "'1.2.3' is not a number"},
      {"time,pv\n0,1\n1,0x10\n", 3, 3, "'0x10' is not a number"},
      {"time,pv\n0,1\n1,+-1\n", 3, 3, "'+-1' is not a number"},
      {"time,pv\n0,1\n1,-inf\n", 3, 3, "'-inf' is not a number; leave the cell"},
      {"time,pv\n0,1\n1,1e999\n", 3, 3, "pv: '1e999' is out of range"},
      {"time,pv\n,1\n1,1\n", 2, 1, "time: no value"},
      {"time,pv\n0,1\nnan,1\n", 3, 1, "time: no value"},
      {"time,pv\n0,1\n1\n", 3, 2, "1 cells where the header has 2"},
      {"time,pv\n0,1\n1,2,3\n", 3, 5, "3 cells where the header has 2"},
      {"time,pv\n0,1\n\n1,2\n", 3, 1, "an empty line"},
      {"time,pv,sp,pv\n0,1,2,3\n", 1, 12, "'pv' appears twice"},
      {"time,co\n0,1\n", 1, 1, "no column 'pv'"},
      {"pv,co\n0,1\n", 1, 1, "no column 'time'"},
      {"Time,pv\n0,1\n", 1, 1, "no column 'time' in the header; is it 'Time'?"},
      {"pv,tiem\n0,1\n", 1, 4, "is it 'tiem'?"},
      {"x,time,FIC101.PV\n0,1,2\n", 1, 8, "is it 'FIC101.PV'?"},
      {"time;pv\n0;1\n", 1, 1, "separated by commas"},
      {"time,\"pv\n0,1\n", 1, 6, "no closing quote"},
      {"time,\"pv\"x\n0,1\n", 1, 10, "after the closing quote"},
      {"time,pv\n0,1\n1,\x1b[31m\n", 3, 3, "'?[31m'"},
  };
  for (const Case& c : cases) {
    INFO(c.text);
    const Failure failure = failure_of(c.text);
    CHECK_THAT(failure.what, Catch::Contains(c.what));
    CHECK(failure.line == c.line);
    CHECK(failure.column == c.column);
    CHECK(failure.kind == RecordError::Kind::data);
    if (c.line > 0 && c.column > 0) {
      CHECK_THAT(failure.what, Catch::StartsWith("r.csv:" + std::to_string(c.line) + ":" +
                                                 std::to_string(c.column) + ": "));
    }
  }
}

TEST_CASE("an error in another line is reported after a long cell") {
  const std::string text = "time,pv\n0,1\n1," + std::string(5000, 'x') + "\n";
  CHECK(failure_of(text).what.size() < 120);
}

TEST_CASE("steps beyond a double are refused") {
  CHECK_THAT(failure_of("time,pv\n-1.5e308,1\n0,1\n1.5e308,1\n").what, Catch::Contains("too long"));
  CHECK(failure_of("time,pv\n-1.7e308,1\n1.7e308,1\n").what != "no failure");
}

TEST_CASE("a written record reads back bit for bit") {
  const TemporaryFolder folder;
  const fs::path path = folder / "r.csv";
  Record record;
  for (int i = 0; i < 5000; ++i) {
    record.time_s.push_back(0.1 * i);
    record.pv.push_back(i % 7 == 3 ? std::numeric_limits<double>::quiet_NaN() : std::sin(i) / 3.0);
    record.co.push_back(std::ldexp(1.0 / (i + 1), i % 600 - 300));
  }
  write_record(record, path);
  const Record again = read_record(path);
  REQUIRE(again.size() == record.size());
  CHECK(again.sp.empty());
  CHECK(again.stem.empty());
  CHECK(again.co == record.co);
  CHECK(missing(again.pv) == 714);
  CHECK(again.period_s == 0.1);
  for (std::size_t i = 0; i < record.size(); ++i) {
    if (std::isnan(record.pv[i])) {
      REQUIRE(std::isnan(again.pv[i]));
    } else {
      REQUIRE(again.pv[i] == record.pv[i]);
    }
    REQUIRE(std::abs(again.time_s[i] - record.time_s[i]) <= 1e-9);
  }
}

TEST_CASE(
    "rows are written with the fewest digits, and values that are not finite as empty cells") {
  const TemporaryFolder folder;
  const fs::path path = folder / "r.csv";
  RecordCsvWriter writer(path, {.sp = false, .co = true, .stem = false, .more = {"flow", "mode"}});
  const double more[] = {0.1, 2.0};
  writer.add({.time_s = 3 * 0.1, .pv = 1.0, .sp = 9.0, .co = -0.25}, more);
  writer.add({.time_s = 0.4, .pv = std::numeric_limits<double>::infinity(), .co = 1e300});
  CHECK(writer.rows() == 2);
  CHECK_FALSE(fs::exists(path));
  writer.finish();
  CHECK(read_file(path) == "time,pv,co,flow,mode\n0.3,1,-0.25,0.1,2\n0.4,,1e+300,,\n");
  CHECK_FALSE(fs::exists(writer.temporary_path()));
}

TEST_CASE("times too fine or too large for rounding are kept") {
  const TemporaryFolder folder;
  RecordCsvWriter writer(folder / "r.csv", {.sp = false, .co = false, .stem = false, .more = {}});
  writer.add({.time_s = 1e-12});
  writer.add({.time_s = 1700000000.1234567});
  writer.finish();
  CHECK(read_file(folder / "r.csv") == "time,pv\n1e-12,\n1700000000.1234567,\n");
}

TEST_CASE("an unfinished record keeps its temporary name and the old file stays") {
  const TemporaryFolder folder;
  const fs::path path = folder / "r.csv";
  write_file(path, "old");
  {
    RecordCsvWriter writer(path, {.sp = false, .co = false, .stem = false, .more = {}});
    writer.add({.time_s = 0.0, .pv = 1.0});
    writer.flush();
  }
  CHECK(read_file(path) == "old");
  CHECK(read_file(folder / "r.csv.tmp") == "time,pv\n0,1\n");
}

TEST_CASE("a full disk is reported and the record is never finished") {
  const TemporaryFolder folder;
  fs::create_symlink("/dev/full", folder / "r.csv.tmp");
  RecordCsvWriter writer(folder / "r.csv");
  bool thrown = false;
  for (int i = 0; i < 20000 && !thrown; ++i) {
    try {
      writer.add({.time_s = 0.1 * i, .pv = 1.0});
    } catch (const RecordError& error) {
      thrown = true;
      CHECK(error.kind() == RecordError::Kind::io);
      CHECK_THAT(error.what(), Catch::Contains("No space left"));
    }
  }
  CHECK(thrown);
  CHECK_THROWS_AS(writer.flush(), RecordError);
  CHECK_THROWS_AS(writer.finish(), RecordError);
  CHECK_FALSE(fs::exists(folder / "r.csv"));
}

TEST_CASE("names that would break the header are refused") {
  const TemporaryFolder folder;
  for (const char* name : {"", "pv", "a,b", "a\nb", "\"a"}) {
    INFO(name);
    CHECK_THROWS_AS(RecordCsvWriter(folder / "r.csv", RecordColumns{.more = {name}}), RecordError);
  }
  CHECK_FALSE(fs::exists(folder / "r.csv.tmp"));
}

TEST_CASE("a file that can't be opened, read or held has its own kind of error") {
  const TemporaryFolder folder;
  const auto kind_of = [](const fs::path& path, std::size_t limit) {
    try {
      read_record(path, limit);
    } catch (const RecordError& error) {
      CHECK_THAT(error.what(), Catch::StartsWith(path.string() + ": "));
      return error.kind();
    }
    throw std::logic_error("no failure");
  };
  CHECK(kind_of(folder / "absent.csv", 100) == RecordError::Kind::io);
  CHECK(kind_of(folder.path(), 100) == RecordError::Kind::io);
  write_file(folder / "r.csv", "time,pv\n0,1\n1,1\n");
  CHECK(kind_of(folder / "r.csv", 15) == RecordError::Kind::data);
  CHECK(read_record(folder / "r.csv", 16).size() == 2);
  CHECK(kind_of("/dev/zero", 1000000) == RecordError::Kind::data);
  CHECK_THROWS_AS(RecordCsvWriter(folder / "absent" / "r.csv"), RecordError);
}

}  // namespace record_csv_test
