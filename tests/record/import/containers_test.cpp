// SPDX-License-Identifier: Apache-2.0
// Archives and workbooks are read as folders of exports.
#include "record/import/containers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "record/import/importer.hpp"
#include "record/import/workbook.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/zip_file.hpp"

namespace loopwarden::tests::containers_test {
namespace {

using namespace loopwarden::record;
namespace fs = std::filesystem;

constexpr std::size_t kSamples = 200;

double pv(std::size_t k) { return 20.0 + 0.125 * static_cast<double>(k % 17); }
double co(std::size_t k) { return 50.0 + 0.25 * static_cast<double>(k % 11); }

std::string csv(const std::string& tag) {
  std::string text = "Time," + tag + ".PV," + tag + ".OP\n";
  for (std::size_t k = 0; k < kSamples; ++k) text += fmt::format("{},{},{}\n", k, pv(k), co(k));
  return text;
}

void same(const Imported& got) {
  REQUIRE(got.record.size() == kSamples);
  CHECK(got.record.period_s == Approx(1.0));
  for (std::size_t k = 0; k < kSamples; ++k) {
    CHECK(got.record.pv[k] == pv(k));
    CHECK(got.record.co[k] == co(k));
  }
}

std::vector<std::string> tags(const Importer& importer) {
  std::vector<std::string> tags;
  for (const FoundLoop& loop : importer.loops()) tags.push_back(loop.tag);
  std::sort(tags.begin(), tags.end());
  return tags;
}

bool has(const std::vector<FileProblem>& problems, const std::string& file,
         const std::string& why) {
  return std::any_of(problems.begin(), problems.end(), [&](const FileProblem& problem) {
    return problem.file.ends_with(file) && problem.why.find(why) != std::string::npos;
  });
}

TEST_CASE("the members of an archive are files, alone and in a folder", "[import]") {
  const TemporaryFolder folder;
  write_zip(folder / "week.zip", {{"day1/FIC1.csv", csv("FIC1")},
                                  {"day1/", ""},
                                  {"FIC2.csv", csv("FIC2")},
                                  {"report.pdf", "%PDF-1.7"},
                                  {"__MACOSX/._FIC2.csv", "x"},
                                  {"inner.zip", "PK"},
                                  {"old.csv.gz", "x"}});
  for (const fs::path& path : {folder / "week.zip", folder.path()}) {
    Importer importer({path}, {});
    CHECK(tags(importer) == std::vector<std::string>{"FIC1", "FIC2"});
    REQUIRE(importer.problems().size() == 2);
    CHECK(has(importer.problems(), "week.zip/inner.zip", "packed within an archive"));
    CHECK(has(importer.problems(), "week.zip/old.csv.gz", "packed within an archive"));
    REQUIRE(importer.passed_over().size() == 1);
    CHECK(has(importer.passed_over(), "week.zip/report.pdf", "PDF"));
    for (std::size_t k = 0; k < importer.loops().size(); ++k) same(importer.read_one(k));
    CHECK(importer.on_disk(0) == folder / "week.zip");
  }
  same(import_record(folder / "week.zip/day1/FIC1.csv", "", {}));
  same(import_record(folder / "week.zip", "FIC2", {}));
  CHECK_THROWS_WITH(import_record(folder / "week.zip/FIC9.csv", "", {}),
                    Catch::Contains("week.zip/FIC9.csv: the archive has no such member"));
  CHECK(std::distance(fs::directory_iterator(folder.path()), {}) == 1);  // no member was unpacked
}

TEST_CASE("names from within a file contain no control characters for a terminal", "[import]") {
  CHECK(plain_name("a\x1B[2J\xC3\xA4\xC2\x9B.csv", "x") == "a?[2J\xC3\xA4?.csv");
  CHECK(plain_name("a\xFF", "member 1") == "member 1");
  CHECK(plain_name("", "member 1") == "member 1");
  const TemporaryFolder folder;
  write_zip(folder / "b.xlsx", workbook_parts({{"a&#27;b", ""}, {"a&#27;b", ""}}));
  Containers containers;
  const auto members = containers.members(folder / "b.xlsx");
  REQUIRE(members.size() == 2);
  CHECK(members[0].path == folder / "b.xlsx/a?b");
  CHECK(members[1].path == folder / "b.xlsx/sheet 2");
}

TEST_CASE("unsupported archives are refused by name", "[import]") {
  const TemporaryFolder folder;
  const auto why = [&](const std::string& name) {
    try {
      Importer importer({folder / name}, {});
    } catch (const RecordError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  write_zip(folder / "bomb.zip", {{"a.csv", std::string(3'000'000, '0')}});
  CHECK_THAT(why("bomb.zip"), Catch::Contains("bomb.zip: is ") &&
                                  Catch::Contains("3000000 when unpacked: more than 200 times"));
  ZipMembers many;
  for (int k = 0; k < 10'001; ++k) many.emplace_back(fmt::format("{}.csv", k), "");
  write_zip(folder / "many.zip", many);
  CHECK_THAT(why("many.zip"), Catch::Contains("has 10001 members, more than 10000"));
  write_file(folder / "cut.zip", read_file(folder / "many.zip").substr(0, 1000));
  CHECK_THAT(why("cut.zip"), Catch::Contains("cut.zip: is a damaged archive"));
  write_zip(folder / "none.zip", {{"a.pdf", "%PDF"}});
  CHECK_THAT(why("none.zip"), Catch::Contains("contains no export"));
  write_zip(folder / "secret.zip", {{"a.csv", csv("FIC1")}}, "word");
  Importer secret({folder / "secret.zip"}, {});
  CHECK(has(secret.problems(), "secret.zip/a.csv", "is encrypted, which is not read"));
  // In a folder each of them is a problem, and the other files are read.
  write_file(folder / "good.csv", csv("FIC7"));
  Importer all({folder.path()}, {});
  CHECK(tags(all) == std::vector<std::string>{"FIC7"});
  CHECK(all.problems().size() == 5);
}

TEST_CASE("wrong sizes in an archive's directory are detected", "[import]") {
  const TemporaryFolder folder;
  write_zip(folder / "a.zip", {{"a.csv", csv("FIC1")}});
  const std::string whole = read_file(folder / "a.zip");
  const std::size_t entry = whole.rfind("PK\x01\x02");
  REQUIRE(entry != std::string::npos);
  for (const int size : {10, 20'000}) {  // unpacked size of the member, at byte 24 of its entry
    std::string lying = whole;
    for (std::size_t k = 0; k < 4; ++k)
      lying[entry + 24 + k] = static_cast<char>(size >> (8U * k) & 0xFF);
    write_file(folder / "lie.zip", lying);
    CHECK_THROWS_WITH(import_record(folder / "lie.zip", "", {}), Catch::Contains("lie.zip/a.csv"));
  }
}

// 46082 is 2026-03-01.
std::string sheet_rows(bool shared_header) {
  std::string rows =
      shared_header
          ? "<row r=\"2\"><c r=\"A2\" t=\"s\"><v>0</v></c><c r=\"B2\" t=\"s\"><v>1</v></c>"
            "<c r=\"C2\" t=\"s\"><v>2</v></c></row>"
          : "<row><c t=\"inlineStr\"><is><t>Time</t></is></c><c "
            "t=\"inlineStr\"><is><r><t>FIC</t></r>"
            "<r><t>1.PV</t></r></is></c><c t=\"inlineStr\"><is><t>FIC1.OP</t></is></c></row>";
  for (std::size_t k = 0; k < kSamples; ++k) {
    rows += fmt::format(
        "<row><c s=\"1\"><v>{:.12f}</v></c><c><v>{}</v></c><c><f>B1*2</f><v>{}</v></c></row>",
        46082.0 + static_cast<double>(k) / 86400.0, pv(k), co(k));
  }
  return rows;
}

constexpr const char* kStyles =
    "<numFmts><numFmt numFmtId=\"164\" formatCode=\"dd.mm.yyyy hh:mm:ss\"/></numFmts>"
    "<cellXfs><xf numFmtId=\"0\"/><xf numFmtId=\"164\"/><xf numFmtId=\"21\"/></cellXfs>";

TEST_CASE("the sheets of a workbook are files; dates by their number format", "[import]") {
  const TemporaryFolder folder;
  const std::vector<std::string> header{"Time", "FIC1.PV", "FIC1.OP"};
  for (const bool shared : {true, false}) {
    write_zip(folder / "b.xlsx", workbook_parts({{"Data &amp; more", sheet_rows(shared)},
                                                 {"Empty", ""},
                                                 {"Note", "<row><c><v>1</v></c></row>"}},
                                                kStyles, header));
    const Imported got = import_record(folder / "b.xlsx", "", {});
    same(got);
    CHECK(got.notes.start->whole_s == 1772323200);
    CHECK(got.notes.layout.find("xlsx, tab") != std::string::npos);
    same(import_record(folder / "b.xlsx/Data & more", "", {}));
    Importer importer({folder.path()}, {});
    CHECK(has(importer.passed_over(), "b.xlsx/Empty", "an empty sheet"));
    CHECK(has(importer.passed_over(), "b.xlsx/Note", "a sheet of one column"));
    CHECK(importer.problems().empty());
  }
  // Dates since 1904, and a prefix for every element.
  std::string rows = sheet_rows(true);
  for (const char* name : {"row", "c", "v"}) {
    for (const std::string& bracket : {std::string("<"), std::string("</")}) {
      const std::string from = bracket + name;
      for (std::size_t at = rows.find(from); at != rows.npos; at = rows.find(from, at + 1)) {
        const char behind = rows[at + from.size()];
        if (behind == ' ' || behind == '>') rows.insert(at + bracket.size(), "x:");
      }
    }
  }
  write_zip(folder / "b.xlsx",
            workbook_parts({{"Data", rows}}, kStyles, header, "<workbookPr date1904=\"1\"/>"));
  const Imported old = import_record(folder / "b.xlsx", "", {});
  same(old);
  CHECK(old.notes.start->whole_s == 1772323200 + 1462LL * 86400);
}

TEST_CASE("cells that are empty, errors, texts with tabs, and dates next to times of day",
          "[import]") {
  const TemporaryFolder folder;
  std::string rows =
      "<row r=\"1\"><c r=\"A1\" t=\"inlineStr\"><is><t>Date</t></is></c><c r=\"B1\" "
      "t=\"inlineStr\">"
      "<is><t>Time</t></is></c><c r=\"D1\" t=\"inlineStr\"><is><t>FIC1.PV</t></is></c>"
      "<c r=\"E1\" t=\"inlineStr\"><is><t>FIC1.OP</t></is></c></row>";
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::string value = k == 5   ? ""
                              : k == 7 ? "<c r=\"D{0}\" t=\"e\"><v>#N/A</v></c>"
                              : k == 9
                                  ? "<c r=\"D{0}\" t=\"inlineStr\"><is><t>a\tb \"c\"</t></is></c>"
                                  : "<c r=\"D{0}\"><v>{1}</v></c>";
    rows += fmt::format(
        "<row r=\"{}\"><c r=\"A{}\" s=\"3\"><v>46082</v></c><c r=\"B{}\" "
        "s=\"2\"><v>{:.12f}</v></c>",
        k + 3, k + 3, k + 3, static_cast<double>(k) / 86400.0);
    rows += fmt::format(fmt::runtime(value), k + 3, pv(k));
    rows += fmt::format("<c r=\"E{}\"><v>{}</v></c></row>", k + 3, co(k));
  }
  const std::string styles =
      "<cellXfs><xf numFmtId=\"0\"/><xf/><xf numFmtId=\"21\"/><xf numFmtId=\"14\"/></cellXfs>";
  write_zip(folder / "b.xlsx", workbook_parts({{"S", rows}}, styles));
  const Imported got = import_record(folder / "b.xlsx", "", {});
  REQUIRE(got.record.size() == kSamples);
  CHECK(numeric::missing(got.record.pv) == 3);
  CHECK(got.notes.bad == 2);
  CHECK(got.record.pv[10] == pv(10));
  REQUIRE(got.notes.words.size() == 1);
  CHECK(got.notes.words.front().word == "a b \"c\"");
  // A place in a sheet is its row and column.
  rows.insert(rows.rfind("<v>") + 3, "1.2.");
  write_zip(folder / "b.xlsx", workbook_parts({{"S", rows}}, styles));
  CHECK_THROWS_WITH(import_record(folder / "b.xlsx", "", {}),
                    Catch::Contains(fmt::format("b.xlsx/S:{}:5: '1.2.", kSamples + 2)));
}

TEST_CASE("number formats decide whether a cell is a date", "[import]") {
  for (const char* code : {"yyyy-mm-dd", "[$-407]d. mmm", "mmm", "d/m/yy;@"})
    CHECK(number_kind(code) == NumberKind::date);
  for (const char* code :
       {"dd.mm.yyyy hh:mm:ss.000", "m/d/yy h:mm AM/PM", "yyyy\\-mm\\-dd\\Thh:mm"})
    CHECK(number_kind(code) == NumberKind::date_time);
  for (const char* code : {"hh:mm:ss", "h:mm AM/PM", "mm:ss.0"})
    CHECK(number_kind(code) == NumberKind::clock);
  CHECK(number_kind("[h]:mm:ss") == NumberKind::elapsed);
  for (const char* code : {"0.00", "#,##0.00 \"m3/h\"", "General", "[Red]0.0", "0.00E+00", "0 \\d",
                           "0%", "@", "_-* #,##0_-", ""})
    CHECK(number_kind(code) == NumberKind::number);
  for (const unsigned id : {14U, 22U, 27U, 36U, 45U, 46U, 58U})
    CHECK(number_kind(id) != NumberKind::number);
  for (const unsigned id : {0U, 2U, 9U, 13U, 37U, 44U, 48U, 49U, 59U})
    CHECK(number_kind(id) == NumberKind::number);
  CHECK(date_text(46082.4375, NumberKind::date_time, false) == "2026-03-01T10:30:00");
  CHECK(date_text(44620.4375, NumberKind::date_time, true) == "2026-03-01T10:30:00");
  CHECK(date_text(46082.0, NumberKind::date, false) == "2026-03-01");
  CHECK(date_text(46082.0 + 0.25 / 86400.0, NumberKind::date, false) == "2026-03-01T00:00:00.250");
  CHECK(date_text(0.4375, NumberKind::clock, false) == "10:30:00");
  CHECK(date_text(0.4375, NumberKind::clock, true) == "10:30:00");
  CHECK(date_text(1.5, NumberKind::elapsed, false) == "129600.000");
  CHECK(date_text(1.0, NumberKind::date, false) == "1900-01-01");
  CHECK(date_text(61.0, NumberKind::date, false) == "1900-03-01");
  for (const double none : {-1.0, 3e6, 1e300, std::nan("")})
    CHECK(date_text(none, NumberKind::date, false) == "########");
}

TEST_CASE("hostile workbooks are refused with the place", "[import]") {
  const TemporaryFolder folder;
  const auto why = [&](const ZipMembers& parts) {
    write_zip(folder / "b.xlsx", parts);
    try {
      Importer importer({folder / "b.xlsx"}, {});
      if (!importer.problems().empty()) return importer.problems().front().why;
    } catch (const RecordError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  const auto sheet = [&](const std::string& rows) { return why(workbook_parts({{"S", rows}})); };
  CHECK_THAT(sheet("<row><c><v>1</v></row>"), Catch::Contains("b.xlsx/S: is damaged XML"));
  CHECK_THAT(sheet("<row r=\"3\"><c><v>1</v></c></row><row r=\"2\"/>"),
             Catch::Contains("b.xlsx/S:4: a row numbered '2' after row 3"));
  CHECK_THAT(sheet("<row r=\"99999999999\"><c><v>1</v></c></row>"),
             Catch::Contains("b.xlsx/S:1: a row"));
  CHECK_THAT(sheet("<row><c r=\"ZZZZZZ1\"><v>1</v></c></row>"),
             Catch::Contains("'ZZZZZZ1' out of place"));
  CHECK_THAT(sheet("<row><c r=\"B1\"><v>1</v></c><c r=\"A1\"><v>1</v></c></row>"),
             Catch::Contains("'A1' out of place"));
  CHECK_THAT(sheet("<row><c t=\"s\"><v>7</v></c></row>"), Catch::Contains("text '7' of 0"));
  ZipMembers parts = workbook_parts({{"S", sheet_rows(false)}}, kStyles);
  for (auto& [name, content] : parts) {
    if (name == "xl/workbook.xml") content = "<!DOCTYPE a [<!ENTITY b \"b\">]><workbook><sheets>";
  }
  CHECK_THAT(why(parts), Catch::Contains("b.xlsx/xl/workbook.xml: is damaged XML"));
  CHECK_THAT(why({{"[Content_Types].xml", "<Types/>"}, {"word/document.xml", "<a/>"}}),
             Catch::Contains("is no workbook"));
  std::string deep;
  for (int k = 0; k < 20000; ++k) deep += fmt::format("<a{}>", k);
  CHECK_FALSE(sheet("<row>" + deep + "</row>").empty());
  write_file(folder / "c.xlsx", "\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1");
  CHECK_THROWS_WITH(import_record(folder / "c.xlsx", "", {}), Catch::Contains("password"));
}

}  // namespace
}  // namespace loopwarden::tests::containers_test
