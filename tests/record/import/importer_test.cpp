// SPDX-License-Identifier: Apache-2.0
// Exports in the forms of many historians, all of the same loop. They must give the same record.
#include "record/import/importer.hpp"

#include <fmt/format.h>
#include <zlib.h>

#include <catch2/catch.hpp>
#include <algorithm>
#include <cmath>
#include <ctime>
#include <functional>
#include <iomanip>
#include <locale>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "model/numeric/random.hpp"
#include "record/import/line_protocol.hpp"
#include "tests/support/archive.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::importer_test {
namespace {

using namespace loopwarden::record;
namespace fs = std::filesystem;

constexpr std::size_t kSamples = 900;
constexpr std::int64_t kStart = 1772404200;  // 2026-03-01T22:30:00Z

struct Loop {
  std::vector<double> pv, co, sp;
};

const Loop& loop() {
  static const Loop made = [] {
    Loop l;
    numeric::Random random(11);
    double wander = 0.0;
    for (std::size_t k = 0; k < kSamples; ++k) {
      wander += 0.02 * random.normal();
      l.pv.push_back(std::nearbyint((20.0 + wander + std::sin(0.03 * static_cast<double>(k)) +
                                     0.05 * random.normal()) *
                                    1e3) /
                     1e3);
      l.co.push_back(std::nearbyint((50.0 + 3.0 * std::sin(0.03 * static_cast<double>(k) - 1.0) +
                                     0.02 * random.normal()) *
                                    1e3) /
                     1e3);
      l.sp.push_back(k < 400 ? 20.0 : 21.5);
    }
    return l;
  }();
  return made;
}

std::string number(double v, char decimal = '.') {
  std::string text = fmt::format("{:.3f}", v);
  std::replace(text.begin(), text.end(), '.', decimal);
  return text;
}

std::string iso(std::size_t k, bool utc = true) {
  return iso_text(kStart + static_cast<std::int64_t>(k), 0.0, utc);
}

std::string date(const char* format, std::size_t k) {
  const std::time_t at = static_cast<std::time_t>(kStart) + static_cast<std::time_t>(k);
  std::tm parts{};
  gmtime_r(&at, &parts);
  std::ostringstream text;
  text.imbue(std::locale::classic());
  text << std::put_time(&parts, format);
  return text.str();
}

// One row per time.
std::string wide(const std::string& header, const std::function<std::string(std::size_t)>& time,
                 char delimiter = ',', char decimal = '.', const std::string& end = "\n") {
  std::string text = header + end;
  for (std::size_t k = 0; k < kSamples; ++k) {
    text += time(k) + delimiter + number(loop().pv[k], decimal) + delimiter +
            number(loop().co[k], decimal) + delimiter + number(loop().sp[k], decimal) + end;
  }
  return text;
}

std::string seconds(std::size_t k) { return std::to_string(k); }

std::string as_utf16(const std::string& text, bool little) {
  std::string out = little ? "\xFF\xFE" : "\xFE\xFF";
  for (const char c : text) {
    if (little) {
      out += c;
      out += '\0';
    } else {
      out += '\0';
      out += c;
    }
  }
  return out;
}

Imported imported(const std::string& text, const ImportOptions& options = {},
                  const std::string& name = "export.csv", const std::string& tag = {}) {
  const TemporaryFolder folder;
  write_file(folder / name, text);
  return import_record(folder / name, tag, options);
}

void same(const Imported& got, double margin = 0.0) {
  REQUIRE(got.record.size() == kSamples);
  CHECK(got.record.period_s == Approx(1.0));
  REQUIRE(!got.record.co.empty());
  REQUIRE(!got.record.sp.empty());
  for (std::size_t k = 0; k < kSamples; ++k) {
    CHECK(got.record.pv[k] == Approx(loop().pv[k]).margin(margin).epsilon(1e-12));
    CHECK(got.record.co[k] == Approx(loop().co[k]).margin(margin).epsilon(1e-12));
    CHECK(got.record.sp[k] == loop().sp[k]);
  }
  CHECK_FALSE(got.notes.compressed());
}

std::string failure(const std::string& text, const ImportOptions& options = {},
                    const std::string& name = "export.csv") {
  try {
    imported(text, options, name);
  } catch (const RecordError& e) {
    return e.what();
  }
  return {};
}

ImportOptions with_time(TimeForm form) {
  ImportOptions options;
  options.time = form;
  return options;
}

TEST_CASE("times in all forms give one record", "[import]") {
  const std::string names = ",FIC101.PV,FIC101.OP,FIC101.SP";
  same(imported(wide("time,pv,co,sp", seconds)));
  same(imported(wide("time" + names, seconds)));
  same(imported(wide("Timestamp" + names, [](std::size_t k) { return iso(k); })));
  same(imported(wide("Timestamp" + names, [](std::size_t k) { return iso(k, false) + "+01:00"; })));
  same(imported(wide("time,pv,co,sp", [](std::size_t k) { return iso(k); })));
  same(imported(wide("time,pv,co,sp", [](std::size_t k) {
    return std::to_string(kStart + static_cast<std::int64_t>(k));
  })));
  same(imported(wide("time,pv,co,sp", [](std::size_t k) {
    return std::to_string(1000 * (kStart + static_cast<std::int64_t>(k)));
  })));
  same(imported(wide("Time (min),PV,OP,SP", [](std::size_t k) {
    return fmt::format("{:.6f}", static_cast<double>(k) / 60.0);
  })));
  same(imported(
      wide("time,pv,co,sp",
           [](std::size_t k) { return fmt::format("{:.6f}", static_cast<double>(k) / 60.0); }),
      with_time(TimeForm::minutes)));
  same(imported(wide("Date,PV,OP,SP", [](std::size_t k) {
    return fmt::format("{:.9f}", 46082.9375 + static_cast<double>(k) / 86400.0);
  })));
  same(imported(wide("time,pv,co,sp", [](std::size_t k) { return date("%d-%b-%y %H:%M:%S", k); })));
}

TEST_CASE("wall-clock time is kept", "[import]") {
  const Imported got = imported(wide("Timestamp,FIC101.PV,FIC101.OP,FIC101.SP",
                                     [](std::size_t k) { return iso(k, false) + "+01:00"; }));
  REQUIRE(got.notes.start);
  CHECK(got.notes.start->whole_s == kStart - 3600);
  CHECK(got.notes.start->zone_known);
  CHECK(got.notes.tag == "FIC101");
  CHECK(got.record.time_s.front() == 0.0);
  ImportOptions local;
  local.zone_s = 7200;
  const Imported shifted = imported(
      wide("Timestamp,FIC101.PV,FIC101.OP,FIC101.SP", [](std::size_t k) { return iso(k, false); }),
      local);
  CHECK(shifted.notes.start->whole_s == kStart - 7200);
}

TEST_CASE("delimiters, decimal commas, encodings, line ends, header lines and units", "[import]") {
  const auto german = [](std::size_t k) { return date("%d.%m.%Y %H:%M:%S", k); };
  const Imported latin = imported(
      wide("Zeit;FIC101.PV;FIC101.OUT;FIC101.SP\n;m\xB3/h;%;m\xB3/h", german, ';', ',', "\r\n"));
  same(latin);
  CHECK(latin.notes.units[index_of(Role::pv)] == "m\xC2\xB3/h");
  CHECK(latin.notes.units[index_of(Role::co)] == "%");
  same(imported("\xEF\xBB\xBF" + wide("Zeit;PV;OP;SP", german, ';', ',')));
  same(imported(wide(
      "Plant 7 export\nby the historian\n\nTimestamp\tPV\tOP\tSP",
      [](std::size_t k) { return iso(k); }, '\t')));
  same(imported(as_utf16(wide(
                             "Timestamp;PV;OP;SP", [](std::size_t k) { return iso(k); }, ';', ','),
                         true)));
  same(imported(as_utf16(wide(
                             "Timestamp;PV;OP;SP", [](std::size_t k) { return iso(k); }, ';', ','),
                         false)));
  same(imported(wide(
      "Timestamp|PV|OP|SP", [](std::size_t k) { return iso(k); }, '|')));
  same(imported(wide("Timestamp,\"PV (m3/h)\",\"OP (%)\",SP",
                     [](std::size_t k) { return "\"" + iso(k) + "\""; })));
  same(imported(wide(
      "Date;Time;PV;OP;SP", [](std::size_t k) { return date("%d.%m.%Y;%H:%M:%S", k); }, ';', ',')));
}

TEST_CASE("an ambiguous order of day and month is asked for", "[import]") {
  const std::string text =
      wide("Date,PV,OP,SP", [](std::size_t k) { return date("%m/%d/%Y 10:%M:%S", k); });
  const std::string what = failure(text);
  CHECK(what.find("--time dmy or --time mdy") != std::string::npos);
  CHECK(what.find("export.csv:") != std::string::npos);
  // Midnight decides the order, because time continues by a second.
  const std::string over_midnight =
      wide("Date,PV,OP,SP", [](std::size_t k) { return date("%m/%d/%Y %H:%M:%S", k + 5300); });
  same(imported(over_midnight));
}

TEST_CASE("one value per row, packed, with qualities and another order", "[import]") {
  std::string text = "Tag,Timestamp,Value,Quality\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    text += "FIC101.PV," + iso(k) + "," + number(loop().pv[k]) + ",Good\n";
    text +=
        "FIC101.OP," + iso(k) + "," + number(loop().co[k]) + "," + (k == 7 ? "Bad" : "Good") + "\n";
    text += "FIC101.SP," + iso(k) + "," + number(loop().sp[k]) + ",Good\n";
    text += "TI205," + iso(k) + ",20,Good\n";
  }
  const TemporaryFolder folder;
  const gzFile out = gzopen((folder / "long.csv.gz").c_str(), "wb");
  REQUIRE(gzwrite(out, text.data(), static_cast<unsigned>(text.size())) ==
          static_cast<int>(text.size()));
  gzclose(out);
  const Imported got = import_record(folder / "long.csv.gz", "", {});
  CHECK(got.record.size() == kSamples);
  CHECK(got.notes.bad == 1);
  CHECK(numeric::missing(got.record.co) == 1);
  CHECK(std::isnan(got.record.co[7]));
  CHECK(got.record.co[8] == loop().co[8]);
  CHECK(got.record.pv == loop().pv);
  // Truncated in the middle of the packed data.
  const std::string whole = read_file(folder / "long.csv.gz");
  write_file(folder / "cut.csv.gz", whole.substr(0, whole.size() / 2));
  CHECK_THROWS_WITH(import_record(folder / "cut.csv.gz", "", {}),
                    Catch::Contains("ends too early"));
}

TEST_CASE("bad values by name are missing samples, counted", "[import]") {
  const auto spoiled = [](const std::string& word) {
    std::string text = "Timestamp,FIC101.PV,FIC101.OP,FIC101.SP\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      text += iso(k) + "," + (k % 100 == 50 ? word : number(loop().pv[k])) + "," +
              number(loop().co[k]) + "," + number(loop().sp[k]) + "\n";
    }
    return text;
  };
  const Imported bad = imported(spoiled("Bad Input"));
  CHECK(bad.notes.bad == 9);
  CHECK(numeric::missing(bad.record.pv) == 9);
  CHECK(std::isnan(bad.record.pv[50]));
  CHECK(imported(spoiled("Questionable")).notes.questionable == 9);
}

TEST_CASE("jittered times are drawn onto a constant period, and the change of PV is reported",
          "[import]") {
  numeric::Random random(5);
  std::vector<double> at(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k)
    at[k] = static_cast<double>(k) + (k > 0 ? random.uniform(-0.2, 0.2) : 0.0);
  const Imported got = imported(
      wide("Time (s),PV,OP,SP", [&](std::size_t k) { return fmt::format("{:.3f}", at[k]); }));
  CHECK(got.record.period_s == Approx(1.0).epsilon(1e-3));
  CHECK(got.notes.moved_pv > 0.0);
  CHECK(got.notes.moved_pv < 0.05);
  CHECK(got.notes.resampled.find("jitter") != std::string::npos);
  const auto was_written = [](double co) {
    return std::find(loop().co.begin(), loop().co.end(), co) != loop().co.end();
  };
  CHECK(std::all_of(got.record.co.begin(), got.record.co.end(), was_written));
  CHECK(got.pv_drawn.empty());
  for (std::size_t k = 5; k + 5 < got.record.size(); ++k)
    CHECK(got.record.pv[k] == Approx(loop().pv[k]).margin(0.2));
}

TEST_CASE(
    "values polled at a varying period are drawn onto a constant one, and don't count as an "
    "archive's",
    "[import]") {
  numeric::Random random(6);
  std::vector<double> at(kSamples);
  for (std::size_t k = 0; k < kSamples; ++k)
    at[k] = static_cast<double>(k) + (k > 0 ? random.uniform(-0.45, 0.45) : 0.0);
  const Imported got = imported(
      wide("Time (s),PV,OP,SP", [&](std::size_t k) { return fmt::format("{:.3f}", at[k]); }));
  CHECK(got.record.period_s == Approx(1.0).epsilon(2e-3));
  CHECK_FALSE(got.notes.compressed());
  CHECK(got.notes.moved_pv > 0.0);
  CHECK(got.notes.resampled.find("at no constant period") != std::string::npos);
}

TEST_CASE("missing rows become missing samples", "[import]") {
  std::string text = "Timestamp,PV,OP,SP\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    if (k >= 300 && k < 320) continue;
    text += iso(k) + "," + number(loop().pv[k]) + "," + number(loop().co[k]) + "," +
            number(loop().sp[k]) + "\n";
  }
  const Imported got = imported(text);
  CHECK(got.record.size() == kSamples);
  CHECK(numeric::missing(got.record.pv) == 20);
  CHECK(got.record.pv[320] == loop().pv[320]);
  CHECK(got.notes.missing == 20);
}

TEST_CASE(
    "stored values are put on the shortest step of their times and filled by the archive's rule",
    "[import]") {
  const Places pv = by_swinging_door(loop().pv, 0.2);
  const Places co = by_exception(loop().co, 0.5);
  std::string text = "TagName,DateTime,Value\n";
  for (const std::size_t k : pv) text += "FIC101.PV," + iso(k) + "," + number(loop().pv[k]) + "\n";
  for (const std::size_t k : co) text += "FIC101.OP," + iso(k) + "," + number(loop().co[k]) + "\n";
  text += "FIC101.SP," + iso(0) + ",20\nFIC101.SP," + iso(400) + ",21.5\n";
  const Imported got = imported(text);
  CHECK(got.record.period_s == 1.0);
  REQUIRE(got.record.size() == kSamples);
  CHECK(got.notes.pv.kind == analysis::ArchiveKind::swinging_door);
  CHECK(got.notes.co.kind == analysis::ArchiveKind::exception);
  CHECK(got.notes.co.deviation == Approx(0.5).epsilon(0.15));
  const std::vector<double> lines = lines_between(loop().pv, pv);
  const std::vector<double> steps = held_between(loop().co, co);
  for (std::size_t k = 0; k + 1 < kSamples; ++k) {
    CHECK(got.record.pv[k] == Approx(lines[k]).margin(1e-9));
    CHECK(got.record.co[k] == steps[k]);
    CHECK(got.record.sp[k] == loop().sp[k]);
  }
  ImportOptions held;
  held.filling = Filling::held;
  CHECK(imported(text, held).record.pv[pv[1] + 1] == loop().pv[pv[1]]);
  CHECK(got.pv_drawn.empty());  // the archive's rule gives the values in between
}

TEST_CASE("between values stored by an unknown rule CO is held and PV is a guess", "[import]") {
  numeric::Random random(3);
  std::string text = "TagName,DateTime,Value\n";
  Places stored;
  for (std::size_t k = 0; k < kSamples; ++k) {
    if (k > 0 && k + 1 < kSamples && random.uniform() < 0.8) continue;
    stored.push_back(k);
    text += "FIC101.PV," + iso(k) + "," + number(loop().pv[k]) + "\n";
    text += "FIC101.OP," + iso(k) + "," + number(loop().co[k]) + "\n";
  }
  const Imported got = imported(text);
  REQUIRE(got.record.size() == kSamples);
  CHECK(got.notes.pv.kind != analysis::ArchiveKind::exception);
  CHECK(got.notes.pv.kind != analysis::ArchiveKind::swinging_door);
  REQUIRE(got.pv_drawn.size() == kSamples);
  const std::vector<double> steps = held_between(loop().co, stored);
  for (std::size_t k = 0; k + 1 < kSamples; ++k) {
    const bool was_stored = std::find(stored.begin(), stored.end(), k) != stored.end();
    CHECK(got.pv_drawn[k] == !was_stored);
    CHECK(got.record.co[k] == steps[k]);
  }
  ImportOptions lines;
  lines.filling = Filling::linear;
  CHECK(imported(text, lines).pv_drawn.empty());
}

TEST_CASE("newest first, a truncated last line, a footer and a delimiter at the end", "[import]") {
  std::string text = "Timestamp,PV,OP,SP\n";
  for (std::size_t k = kSamples; k-- > 0;) {
    text += iso(k) + "," + number(loop().pv[k]) + "," + number(loop().co[k]) + "," +
            number(loop().sp[k]) + "\n";
  }
  same(imported(text));
  const std::string up = wide("Timestamp,PV,OP,SP", [](std::size_t k) { return iso(k); });
  same(imported(up + iso(kSamples) + ",20."));
  same(imported(up + "\n(900 rows affected)\n"));
  same(imported(wide(
      "Timestamp,PV,OP,SP,", [](std::size_t k) { return iso(k); }, ',', '.', ",\n")));
}

// Rows that end early are examined again while the file is read block by block.
TEST_CASE("short rows at any place of a long file keep their values", "[import]") {
  constexpr std::size_t kRows = 30000;  // 0.8 MB, three blocks
  std::string text = "Timestamp,PV,OP,Remark\n";
  for (std::size_t k = 0; k < kRows; ++k) {
    text += iso(k) + "," + number(loop().pv[k % kSamples]) + "," + number(loop().co[k % kSamples]) +
            "\n";
  }
  const Imported got = imported(text + iso(kRows) + ",2");
  REQUIRE(got.record.size() == kRows);
  for (std::size_t k = 0; k < kRows; ++k) {
    if (got.record.pv[k] != Approx(loop().pv[k % kSamples])) FAIL("row " << k);
    if (got.record.co[k] != Approx(loop().co[k % kSamples])) FAIL("row " << k);
  }
  // One value per row: the truncated row is the last of the file.
  std::string tall = "Tag,Timestamp,Value\n";
  for (std::size_t k = 0; k < kRows; ++k) {
    tall += "FIC1.PV," + iso(k) + "," + number(loop().pv[k % kSamples]) + "\n";
    tall += "FIC1.OP," + iso(k) + "," + number(loop().co[k % kSamples]) + "\n";
  }
  CHECK(imported(tall + "FIC1.PV,2026-03").record.size() == kRows);
}

TEST_CASE("the later of two values with one time is used, and both are counted", "[import]") {
  std::string text = "Tag,Timestamp,Value\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    text += "FIC1.PV," + iso(k) + "," + number(loop().pv[k]) + "\n";
    if (k == 77) text += "FIC1.PV," + iso(k) + ",19.5\n";
    text += "FIC1.OP," + iso(k) + "," + number(loop().co[k]) + "\n";
  }
  const Imported got = imported(text);
  CHECK(got.notes.same_time == 1);
  CHECK(got.record.pv[77] == 19.5);
}

TEST_CASE("local times at the end of summer time continue", "[import]") {
  std::string text = "Timestamp,PV,OP,SP\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::size_t at = 10 * k + 1000;
    text += iso(at >= 5000 ? at - 3600 : at, false) + "," + number(loop().pv[k]) + "," +
            number(loop().co[k]) + "," + number(loop().sp[k]) + "\n";
  }
  const Imported got = imported(text);
  CHECK(got.record.size() == kSamples);
  CHECK(got.record.period_s == 10.0);
  REQUIRE_FALSE(got.notes.remarks.empty());
  CHECK(got.notes.remarks.front().find("summer time") != std::string::npos);
}

TEST_CASE("other times that run backwards are an error with their line", "[import]") {
  std::string text = "Timestamp,PV,OP,SP\n";
  for (std::size_t k = 0; k < kSamples; ++k) text += iso(k == 100 ? 90 : k) + ",1,2,3\n";
  const std::string what = failure(text);
  CHECK(what.find("export.csv:102: the time decreases by 9 s") != std::string::npos);
}

TEST_CASE("several loops in a file are separated by tag, and a choice is asked for", "[import]") {
  std::string text =
      "Timestamp,FIC101.PV,FIC101.OP,FIC101.SP,FIC102.PV,FIC102.OP,FIC102.SP,TI205\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::string values =
        number(loop().pv[k]) + "," + number(loop().co[k]) + "," + number(loop().sp[k]);
    text += iso(k) + "," + values + "," + number(2.0 * loop().pv[k]) + "," + number(loop().co[k]) +
            ",42,17\n";
  }
  same(imported(text, {}, "export.csv", "FIC101"));
  CHECK(imported(text, {}, "export.csv", "fic102").record.pv[5] == Approx(2.0 * loop().pv[5]));
  const std::string what = failure(text);
  CHECK(what.find("2 loops (FIC101, FIC102)") != std::string::npos);
  CHECK(what.find("--loop TAG") != std::string::npos);
  ImportOptions mapped;
  mapped.loops = {{.tag = "", .names = {"FIC102.PV", "", "FIC101.OP", "", ""}, .units = {}}};
  CHECK(imported(text, mapped).record.pv[5] == Approx(2.0 * loop().pv[5]));
  mapped.loops.front().names[0] = "FIC103.PV";
  CHECK(failure(text, mapped).find("no column or tag 'FIC103.PV'; is it 'FIC101.PV'?") !=
        std::string::npos);
  mapped.loops.front().names = {"4", "", "2", "", ""};  // by number; the first column is the time
  CHECK(imported(text, mapped).notes.names[index_of(Role::co)] == "FIC101.PV");
}

TEST_CASE("a mode requested by the operator is no separate loop", "[import]") {
  const TemporaryFolder folder;
  std::string text = "time_s,pv,sp,co,mode,requested_mode\n";
  for (int k = 0; k < 20; ++k) text += number(k) + ",5,5,4,1,1\n";
  write_file(folder / "FIC-102.csv", text);
  const Importer importer({folder / "FIC-102.csv"}, {});
  REQUIRE(importer.loops().size() == 1);
  CHECK(importer.loops().front().tag == "FIC-102");
  CHECK(importer.other_names() == std::vector<std::string>{"requested_mode"});
}

TEST_CASE("a folder: a loop continues from file to file, and one bad file is left out",
          "[import]") {
  const TemporaryFolder folder;
  const auto part = [&](std::size_t from, std::size_t to) {
    std::string text = "Timestamp,FIC101.PV,FIC101.OP,FIC101.SP\n";
    for (std::size_t k = from; k < to; ++k) {
      text += iso(k) + "," + number(loop().pv[k]) + "," + number(loop().co[k]) + "," +
              number(loop().sp[k]) + "\n";
    }
    return text;
  };
  write_file(folder / "b.csv", part(0, 500));
  write_file(folder / "a.csv", part(480, kSamples));
  write_file(folder / "broken.csv", "nothing, of, use\n1;2\n");
  write_file(folder / "notes.md", "no export");
  Importer importer({folder.path()}, {});
  REQUIRE(importer.loops().size() == 1);
  CHECK(importer.loops().front().files.size() == 2);
  REQUIRE(importer.problems().size() == 1);
  CHECK(importer.problems().front().file.ends_with("broken.csv"));
  same(importer.read_one(0));
}

// The results of Importer::read for a folder.
struct ReadAll {
  std::map<std::string, std::size_t> samples;  // by tag
  std::vector<std::string> failures;
};

ReadAll read_all(const fs::path& folder) {
  Importer importer({folder}, {});
  std::vector<std::size_t> which(importer.loops().size());
  for (std::size_t k = 0; k < which.size(); ++k) which[k] = k;
  ReadAll out;
  importer.read(
      which,
      [&](std::size_t k, const Imported& one) {
        out.samples[importer.loops()[k].tag] = one.record.size();
      },
      [&](std::size_t k, std::size_t file, const RecordError& e) {
        out.failures.push_back(importer.loops()[k].tag + " " +
                               importer.file(file).filename().string() + " " + e.what());
      });
  return out;
}

TEST_CASE("an unreadable cell fails its loop, and not the others of the file", "[import]") {
  for (const bool is_long : {false, true}) {
    INFO(is_long);
    std::string text =
        is_long ? "Tag,Timestamp,Value\n" : "Timestamp,FIC1.PV,FIC1.OP,FIC2.PV,FIC2.OP\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      const std::string pv = k == 700 ? "12..5" : number(loop().pv[k]);
      const std::string co = number(loop().co[k]);
      if (!is_long) {
        text += iso(k) + "," + pv + "," + co + "," + number(loop().pv[k]) + "," + co + "\n";
        continue;
      }
      for (const auto& [tag, value] : {std::pair{"FIC1.PV", pv},
                                       {"FIC1.OP", co},
                                       {"FIC2.PV", number(loop().pv[k])},
                                       {"FIC2.OP", co}}) {
        text += std::string(tag) + "," + iso(k) + "," + value + "\n";
      }
    }
    const TemporaryFolder folder;
    write_file(folder / "e.csv", text);
    const ReadAll got = read_all(folder.path());
    CHECK(got.samples == std::map<std::string, std::size_t>{{"FIC2", kSamples}});
    REQUIRE(got.failures.size() == 1);
    CHECK(got.failures.front().starts_with("FIC1 e.csv"));
    CHECK(got.failures.front().find("--bad-value '12..5'") != std::string::npos);
  }
}

void write_gzip(const fs::path& path, const std::string& text, double share) {
  const gzFile out = gzopen(path.c_str(), "wb");
  REQUIRE(gzwrite(out, text.data(), static_cast<unsigned>(text.size())) ==
          static_cast<int>(text.size()));
  gzclose(out);
  const std::string packed = read_file(path);
  write_file(
      path, packed.substr(0, static_cast<std::size_t>(share * static_cast<double>(packed.size()))));
}

TEST_CASE("a truncated packed file doesn't affect valid files", "[import]") {
  std::string tall = "Tag,Timestamp,Value\n";
  for (std::size_t k = 0; k < 40 * kSamples; ++k) {
    tall += "FIC0.PV," + iso(k) + "," + number(loop().pv[k % kSamples]) + "\n";
    tall += "FIC0.OP," + iso(k) + "," + number(loop().co[k % kSamples]) + "\n";
  }
  // Truncated after its first lines. They show that it is an export, and not which loops it
  // contains.
  const TemporaryFolder folder;
  write_gzip(folder / "0.csv.gz", tall, 0.5);
  std::map<std::string, std::size_t> sound;
  for (int k = 1; k <= 5; ++k) {
    const std::string tag = "FIC" + std::to_string(k);
    write_file(folder / (tag + ".csv"),
               wide("Timestamp," + tag + ".PV," + tag + ".OP," + tag + ".SP",
                    [](std::size_t at) { return iso(at); }));
    sound[tag] = kSamples;
  }
  const ReadAll got = read_all(folder.path());
  CHECK(got.samples == sound);
  CHECK(got.failures.empty());
  Importer importer({folder.path()}, {});
  REQUIRE(importer.problems().size() == 1);
  CHECK(importer.problems().front().why.find("0.csv.gz: is a gzip file that ends too early") !=
        std::string::npos);
  for (const FoundLoop& found : importer.loops()) {
    REQUIRE(found.files.size() == 1);
    CHECK(importer.file(found.files.front()).filename() == found.tag + ".csv");
  }
}

TEST_CASE("rows wider than their header are refused, with the line", "[import]") {
  // A comma for the decimals and one between the cells, so the cells can't be assigned.
  std::string text = "Tag,Timestamp,Value\n";
  for (std::size_t k = 0; k < kSamples; ++k)
    text += "FIC1,PV," + iso(k) + "," + number(loop().pv[k]) + "\n";
  CHECK(failure(text).find("export.csv:2: 4 cells where the header has 3") != std::string::npos);
  std::string counted = "Tag,Timestamp,Value\n";
  for (std::size_t k = 0; k < kSamples; ++k)
    counted += "FIC1,PV," + seconds(k) + "," + number(loop().pv[k]) + "\n";
  CHECK(failure(counted).find("export.csv:2: 4 cells where the header has 3") != std::string::npos);
  // After the lines that determine the layout.
  const std::string rows = wide("Timestamp,PV,OP,SP", [](std::size_t k) { return iso(k); });
  const std::string wider = iso(kSamples) + ",20,50,20,7\n" + iso(kSamples + 1) + ",20,50,20\n";
  CHECK(failure(rows + wider).find("export.csv:902:") != std::string::npos);
  CHECK(failure(rows + wider).find("5 cells where the header has 4") != std::string::npos);
  std::string tall = "Tag,Timestamp,Value\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    tall += "FIC1.PV," + iso(k) + "," + (k == 700 ? "19,5" : "20") + "\n";
    tall += "FIC1.OP," + iso(k) + ",50\n";
  }
  const std::string what = failure(tall);
  CHECK(what.find("export.csv:1402:") != std::string::npos);
  CHECK(what.find("4 cells where the header has 3") != std::string::npos);
  CHECK(what.find("double quotes") != std::string::npos);
}

TEST_CASE("a spreadsheet's error in any language is a bad value", "[import]") {
  for (const char* word : {"#WERT!", "#NV", "#VALEUR!", "#\xC2\xA1VALOR!", "#DIV/0!", "#N/A",
                           "#ZNA\xC4\x86!", "#NOMBRE?", "########"}) {
    INFO(word);
    std::string text = "Timestamp,PV,OP,SP\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      text += iso(k) + "," + (k % 50 == 7 ? word : number(loop().pv[k])) + "," +
              number(loop().co[k]) + ",20\n";
    }
    CHECK(imported(text).notes.bad == 18);
  }
}

TEST_CASE("unknown words are bad values if nine of ten cells are numbers, and are reported",
          "[import]") {
  const auto with = [](std::size_t cells, const std::string& word, const std::string& other,
                       bool is_long = false) {
    std::string text = is_long ? "Tag,Timestamp,Value\n" : "Timestamp,FIC1.PV,FIC1.OP\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      const std::string pv =
          k >= 100 && k < 100 + cells ? (k % 3 > 0 ? word : other) : number(loop().pv[k]);
      const std::string co = number(loop().co[k]);
      text += is_long ? "FIC1.PV," + iso(k) + "," + pv + "\nFIC1.OP," + iso(k) + "," + co + "\n"
                      : iso(k) + "," + pv + "," + co + "\n";
    }
    return text;
  };
  for (const bool is_long : {false, true}) {
    const Imported got = imported(with(90, "Wartung", "Scan Fehler!", is_long));
    CHECK(got.notes.bad == 90);
    CHECK(numeric::missing(got.record.pv) == 90);
    REQUIRE(got.notes.words.size() == 2);
    const std::string said = bad_words_text(got.notes.words);
    CHECK(said.find("export.csv: 'Wartung' in 60 cells of FIC1.PV: taken as a bad value\n") !=
          std::string::npos);
    CHECK(said.find("export.csv: 'Scan Fehler!' in 30 cells") != std::string::npos);
  }
  const std::string what = failure(with(91, "Wartung", "Wartung"));
  CHECK(what.find("export.csv:102:22: 'Wartung' is not a number") != std::string::npos);
  CHECK(what.find("--bad-value 'Wartung'") != std::string::npos);
  ImportOptions options;
  options.bad_words = {"wartung"};
  CHECK(imported(with(91, "Wartung", "Wartung"), options).notes.bad == 91);
  for (const char* no_word : {"1.2.3", "-5x", "12 m", "+"})
    CHECK(failure(with(2, no_word, no_word)).find("is not a number") != std::string::npos);
  // One line per word and file, for all its signals.
  CHECK(bad_words_text({{"a.csv", "X.PV", "aus", 2},
                        {"a.csv", "X.OP", "aus", 3},
                        {"a.csv", "X.PV", "aus", 2},
                        {"b.csv", "X.PV", "aus", 1}}) ==
        "a.csv: 'aus' in 5 cells of 2 signals: taken as a bad value\n"
        "b.csv: 'aus' in 1 cell of X.PV: taken as a bad value\n");
}

// An OPC logger by exception. Each value of a scan has a separate time stamp.
std::string logged(double scan_s, double jitter_s) {
  numeric::Random random(7);
  constexpr std::size_t kScans = 3600;
  std::vector<double> pv(kScans), co(kScans);
  for (std::size_t k = 0; k < kScans; ++k) {
    pv[k] = 20.0 + std::sin(0.03 * static_cast<double>(k)) + 0.05 * random.normal();
    co[k] = 50.0 + 3.0 * std::sin(0.03 * static_cast<double>(k) - 1.0) + 0.02 * random.normal();
  }
  std::string text = "Tag,Timestamp,Value\n";
  const auto stamp = [&](std::size_t k) {
    const double at = scan_s * static_cast<double>(k) + random.uniform(0.0, jitter_s);
    return iso_text(kStart + static_cast<std::int64_t>(at), at - std::floor(at), true);
  };
  for (const std::size_t k : by_exception(pv, 0.2))
    text += "FIC1.PV," + stamp(k) + "," + number(pv[k]) + "\n";
  for (const std::size_t k : by_exception(co, 0.5))
    text += "FIC1.OP," + stamp(k) + "," + number(co[k]) + "\n";
  return text;
}

TEST_CASE("the scan gives the period, also if stamps jitter by milliseconds", "[import]") {
  for (const double scan : {0.5, 1.0, 5.0}) {
    for (const double jitter : {0.0049, 0.08}) {
      INFO(scan << " " << jitter);
      const Imported got = imported(logged(scan, jitter * scan));
      CHECK(got.record.period_s == scan);
      CHECK(got.record.size() <= 3601);
      CHECK(got.notes.resampled.find("multiples") != std::string::npos);
    }
  }
  // An unusual scan period.
  CHECK(imported(logged(1.7, 0.004)).record.period_s == Approx(1.7).epsilon(1e-3));
  // Two values of a scan, a few milliseconds apart, don't make a scan of milliseconds.
  std::string twice = "Tag,Timestamp,Value\n";
  numeric::Random random(8);
  double at = 0.0;
  for (std::size_t k = 0; k < 500; ++k) {
    at += 1.0 + std::floor(random.uniform(0.0, 6.0));
    const auto row = [&](const char* tag, double rest, double value) {
      twice += fmt::format("{},{},{:.3f}\n", tag,
                           iso_text(kStart + static_cast<std::int64_t>(at), rest, true), value);
    };
    row("FIC1.PV", 0.001, random.normal());
    if (k % 10 == 0) row("FIC1.PV", 0.004, random.normal());
    row("FIC1.OP", 0.002, random.normal());
  }
  CHECK(imported(twice).record.period_s == 1.0);
}

TEST_CASE("values without a scan are put on a period derived from their density", "[import]") {
  numeric::Random random(9);
  std::string text = "Tag,Timestamp,Value\n";
  double at = 0.0;
  for (std::size_t k = 0; k < 1000; ++k) {
    at += -3.0 * std::log(random.uniform(1e-6, 1.0)) + 0.001;  // intervals of independent events
    text += fmt::format("FIC1.PV,{},{:.3f}\n",
                        iso_text(kStart + static_cast<std::int64_t>(at), at - std::floor(at), true),
                        random.normal());
  }
  const Imported got = imported(text);
  CHECK(got.record.period_s >= 0.05);
  CHECK(got.record.size() <= 40 * 1000);
  CHECK(got.notes.resampled.find("no common step") != std::string::npos);
}

TEST_CASE("a record with more than 50 samples per value is refused unless its period is given",
          "[import]") {
  numeric::Random random(12);
  std::string text = "Tag,Timestamp,Value\n";
  std::int64_t at = kStart;
  for (std::size_t k = 0; k < 60; ++k) {
    at += static_cast<std::int64_t>(random.uniform(20.0, 180.0));
    text += "FIC1.PV," + iso_text(at, random.uniform(0.0, 0.004), true) + "," +
            number(loop().pv[k]) + "\n";
  }
  const std::string what = failure(text);
  INFO(what);
  CHECK(what.find("samples of 1 s, more than 50 per value") != std::string::npos);
  const std::size_t help = what.find("--period ");
  REQUIRE(help != std::string::npos);
  ImportOptions told;
  told.period_s = std::stod(what.substr(help + 9));
  CHECK(imported(text, told).record.period_s == *told.period_s);
  told.period_s = 1.0;
  CHECK(imported(text, told).record.size() > 50 * 60);
  // Two hours of values, half a year apart.
  std::string gap = "Timestamp,PV,OP\n";
  for (std::size_t k = 0; k < 2 * kSamples; ++k) {
    gap += iso(k < kSamples ? k : k + 180UL * 86400) + "," + number(loop().pv[k % kSamples]) + "," +
           number(loop().co[k % kSamples]) + "\n";
  }
  CHECK(failure(gap).find("there are no values for up to 4.32e+03 h") != std::string::npos);
}

TEST_CASE("InfluxDB's annotated CSV is read by series", "[import]") {
  const std::string annotations =
      "#group,false,false,true,true,false,false,true,true,true\n"
      "#datatype,string,long,dateTime:RFC3339,dateTime:RFC3339,dateTime:RFC3339,double,string,"
      "string,string\n"
      "#default,_result,,,,,,,,\n";
  const std::string header = ",result,table,_start,_stop,_time,_value,_field,_measurement,unit\n";
  const auto series = [&](int table, const std::string& field, const std::vector<double>& values) {
    std::string rows = annotations + header;
    for (std::size_t k = 0; k < kSamples; ++k) {
      rows += ",," + std::to_string(table) + "," + iso(0) + "," + iso(kSamples) + "," + iso(k) +
              "," + number(values[k]) + "," + field + ",plant,FIC101\n";
    }
    return rows + "\n";
  };
  const std::string text =
      series(0, "PV", loop().pv) + series(1, "OP", loop().co) + series(2, "SP", loop().sp);
  const Imported got = imported(text);
  same(got);
  CHECK(got.notes.tag == "plant.FIC101");
  CHECK(got.notes.start->whole_s == kStart);
  // A field without meaning, with the signal in a tag column.
  std::string by_tag = annotations + header;
  for (std::size_t k = 0; k < kSamples; ++k) {
    for (const auto& [tag, value] : {std::pair{"FIC7.PV", loop().pv[k]}, {"FIC7.OP", loop().co[k]}})
      by_tag += ",,0," + iso(0) + "," + iso(9) + "," + iso(k) + "," + number(value) +
                ",value,opc," + tag + "\n";
  }
  CHECK(imported(by_tag).notes.tag == "opc.FIC7");
  // A table with other columns, and one with its columns in the defaults.
  std::string others = text;
  others += "#default,_result,,,,,,FIC102\n,result,table,_time,_value,_field,_measurement,unit\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    for (const auto& [field, value] : {std::pair{"PV", loop().pv[k]}, {"OP", loop().co[k]}})
      others += ",,3," + iso(k) + "," + number(value) + "," + field + ",plant,\n";
  }
  same(imported(others, {}, "export.csv", "plant.FIC101"));
  CHECK(imported(others, {}, "export.csv", "plant.FIC102").record.co == loop().co);
  CHECK(failure(text + "#group,false\n,result,table,_time,_field,_measurement,site\n")
            .find("a table without _time, _field and _value begins here") != std::string::npos);
  // One column per field, as pivot() writes it.
  std::string pivoted = ",result,table,_start,_stop,_time,_measurement,FIC9.PV,FIC9.OP,FIC9.SP\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    pivoted += ",,0," + iso(0) + "," + iso(kSamples) + "," + iso(k) + ",opc," +
               number(loop().pv[k]) + "," + number(loop().co[k]) + "," + number(loop().sp[k]) +
               "\n";
  }
  same(imported(pivoted));
}

TEST_CASE("times and values in pairs of columns of different lengths", "[import]") {
  // As DataLink writes it: names above the times or the values, and a separate time for each value.
  for (const char* header : {"FIC-128.PV,,FIC-128.OP,,FIC-128.SP,",
                             "Timestamp,FIC-128.PV,Timestamp,FIC-128.OP,Timestamp,FIC-128.SP",
                             "FIC-128.PV Time,FIC-128.PV Value,FIC-128.OP Time,FIC-128.OP Value,"
                             "FIC-128.SP Time,FIC-128.SP Value"}) {
    INFO(header);
    for (const bool short_rows : {false, true}) {
      std::string text = std::string(header) + "\n";
      for (std::size_t k = 0; k < kSamples; ++k) {
        text += date("%d-%b-%y %H:%M:%S", k) + "," + number(loop().pv[k]) + ",";
        text += 2 * k < kSamples ? date("%d-%b-%y %H:%M:%S", 2 * k) + "," + number(loop().co[2 * k])
                                 : (short_rows ? "" : ",");
        if (k < 2) {
          text += "," + date("%d-%b-%y %H:%M:%S", 400 * k) + "," + (k == 0 ? "20" : "21.5");
        } else if (!short_rows) {
          text += k == 2 ? ",No events found.," : ",,";
        }
        text += "\n";
      }
      const Imported got = imported(text);
      REQUIRE(got.record.size() == kSamples);
      CHECK(got.notes.tag == "FIC-128");
      CHECK(got.notes.start->whole_s == kStart);
      CHECK(got.notes.layout.find("in pairs of columns") != std::string::npos);
      CHECK(got.record.sp == loop().sp);
      for (std::size_t k = 0; k < kSamples; k += 2) {
        CHECK(got.record.pv[k] == loop().pv[k]);
        CHECK(got.record.co[k] == loop().co[k]);
      }
    }
  }
  // Two columns of times without a second column of values make no pairs.
  ImportOptions mapped;
  mapped.loops = {{.tag = "", .names = {"Value", "", "", "", ""}, .units = {}}};
  std::string spans = "StartTime,Value,EndTime,Status\n";
  for (std::size_t k = 0; k < kSamples; ++k)
    spans += iso(k) + "," + number(loop().pv[k]) + "," + iso(k + 1) + ",3\n";
  CHECK(imported(spans, mapped).record.pv == loop().pv);
  // An unreadable time is reported with its place.
  std::string broken = "FIC1.PV,,FIC1.OP,\n";
  for (std::size_t k = 0; k < kSamples; ++k)
    broken += iso(k) + ",20," + (k == 700 ? "yesterday" : iso(k)) + ",50\n";
  CHECK(failure(broken).find("export.csv:702:25: 'yesterday' is no time") != std::string::npos);
}

TEST_CASE("unsupported formats give an error with a remedy", "[import]") {
  const std::string zip("PK\x03\x04\x14\0\0\0\0\0", 10);
  const TemporaryFolder folder;
  const auto said = [&](const std::string& name, const std::string& content) {
    write_file(folder / name, content);
    try {
      import_record(folder / name, "", {});
    } catch (const RecordError& e) {
      return std::string(e.what());
    }
    return std::string();
  };
  CHECK_THAT(said("a.ods", zip + "mimetypeapplication/vnd.oasis.opendocument.spreadsheet"),
             Catch::Contains("save it as .xlsx or CSV"));
  CHECK_THAT(said("a.xls", "\xD0\xCF\x11\xE0\xA1\xB1\x1A\xE1"), Catch::Contains("as CSV"));
  CHECK_THAT(said("a.pdf", "%PDF-1.7\n"), Catch::Contains("is a PDF"));
  CHECK_THAT(said("a.json", "[\n  {\"time\": 1, \"pv\": 2}\n]\n"), Catch::Contains("is JSON"));
}

TEST_CASE("other files of a folder are listed with the reason", "[import]") {
  const TemporaryFolder folder;
  for (const char* name : {"a.pdf", "b.json", "c.JPG", "d.raw", ".hidden.zip"})
    write_file(folder / name, "x");
  CHECK_THROWS_WITH(
      Importer({folder.path()}, {}),
      Catch::Contains("no file .csv") && Catch::Contains("a.pdf: a PDF holds no values"));
  write_file(folder / "e.csv", wide("time,pv,co,sp", seconds));
  Importer importer({folder.path()}, {});
  CHECK(importer.passed_over().size() == 4);
  const std::string said = importer.passed_over_text();
  for (const char* part : {"a.pdf: a PDF holds no values", "b.json: JSON is not read",
                           "c.JPG: a picture", "d.raw: unknown file type"}) {
    INFO(part);
    CHECK(said.find(part) != std::string::npos);
  }
  for (int k = 0; k < 7; ++k) write_file(folder / fmt::format("p{}.jpg", k), "x");
  CHECK(Importer({folder.path()}, {}).passed_over_text().find(" and 3 more: a picture") !=
        std::string::npos);
  const Imported got = import_record(folder.path(), "", {});
  REQUIRE(got.notes.remarks.size() == 1);
  CHECK(Importer({folder / "e.csv"}, {}).passed_over_text().empty());
}

TEST_CASE("loops of one name in several files stay apart", "[import]") {
  const TemporaryFolder folder;
  for (const char* name : {"a/e.csv", "b/e.csv", "c/e.csv"})
    write_file(folder / name, wide("time,pv,co,sp", seconds));
  Importer importer({folder.path()}, {});
  REQUIRE(importer.loops().size() == 3);
  CHECK(importer.loops()[1].tag == "e in e");
  CHECK(importer.loops()[2].tag == "e in e (2)");
}

TEST_CASE("tags of a transmitter and a valve are offered as a loop", "[import]") {
  const auto hint = [](const std::string& names) {
    const TemporaryFolder folder;
    write_file(folder / "e.csv", "Time," + names + "\n1,2,3\n2,3,4\n3,4,5\n");
    return Importer({folder.path()}, {}).pairs_hint();
  };
  CHECK(hint("FT129,FV129") == "If FT129 is PV and FV129 is CO, add: --map pv=FT129,co=FV129");
  CHECK(hint("12-FI-129A,12-FV-129A").find("--map pv=12-FI-129A,co=12-FV-129A") !=
        std::string::npos);
  CHECK(hint("FT129,FV130").empty());
  CHECK(hint("FT129,LV129").empty());
  CHECK(failure("Time,FT129,FV129\n1,2,3\n2,3,4\n").find("--map pv=FT129,co=FV129") !=
        std::string::npos);
}

TEST_CASE("a bad file of a loop in several files is left out and listed", "[import]") {
  const auto part = [&](std::size_t from, std::size_t to, const std::string& broken) {
    std::string text = "Timestamp,FIC101.PV,FIC101.OP\n";
    for (std::size_t k = from; k < to; ++k) {
      text += iso(k) + "," + number(loop().pv[k]) + "," + number(loop().co[k]) +
              (k == to - 5 ? broken : "") + "\n";
    }
    return text;
  };
  const TemporaryFolder folder;
  write_file(folder / "1.csv", part(0, 300, ""));
  write_file(folder / "2.csv", part(300, 600, ",1,2,3"));
  write_file(folder / "3.csv", part(600, kSamples, ""));
  const ReadAll got = read_all(folder.path());
  CHECK(got.samples.at("FIC101") == kSamples);  // the hours between are missing samples
  REQUIRE(got.failures.size() == 1);
  CHECK(got.failures.front().starts_with("FIC101 2.csv"));
  // A command for one record needs all of it.
  CHECK_THROWS_AS(import_record(folder.path(), "", {}), RecordError);
}

TEST_CASE("an exception of the receiver of a loop is passed on", "[import]") {
  const TemporaryFolder folder;
  write_file(folder / "e.csv", wide("time,pv,co,sp", seconds));
  Importer importer({folder / "e.csv"}, {});
  const std::vector<std::size_t> which{0};
  bool failed = false;
  CHECK_THROWS_AS(importer.read(
                      which,
                      [](std::size_t, const Imported&) {
                        throw RecordError(RecordError::Kind::io, 0, 0, "no space");
                      },
                      [&](std::size_t, std::size_t, const RecordError&) { failed = true; }),
                  RecordError);
  CHECK_FALSE(failed);
}

// Returns PV and CO as whole numbers with a thousands mark, in rows of one value or one time.
std::string grouped(const std::string& mark, char delimiter, bool is_long, double scale = 50.0,
                    const std::string& decimals_of_co = "") {
  const auto cell = [&](double value) {
    const auto whole = static_cast<long>(std::nearbyint(value));
    std::string text = std::to_string(whole);
    if (whole >= 1000) text.insert(text.size() - 3, mark);
    return "\"" + text + "\"";
  };
  const std::string d(1, delimiter);
  std::string text =
      is_long ? "Series" + d + "Time" + d + "Value\n" : "Time" + d + "FIC1.PV" + d + "FIC1.OP\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::string pv = cell(scale * loop().pv[k]);
    const std::string co =
        std::to_string(static_cast<long>(std::nearbyint(loop().co[k]))) + decimals_of_co;
    text += is_long ? "FIC1.PV" + d + iso(k) + d + pv + "\nFIC1.OP" + d + iso(k) + d + co + "\n"
                    : iso(k) + d + pv + d + "\"" + co + "\"\n";
  }
  return text;
}

TEST_CASE("thousands marks are no decimal marks", "[import]") {
  for (const char* mark : {",", ".", "'", "\u2019", "\u202f", "\u00a0", " ", "\u2009"}) {
    for (const char delimiter : {';', ',', '\t'}) {
      for (const bool is_long : {false, true}) {
        INFO("'" << mark << "' '" << delimiter << "' " << is_long);
        const Imported got = imported(grouped(mark, delimiter, is_long));
        for (std::size_t k = 0; k < kSamples; ++k)
          CHECK(got.record.pv[k] == std::nearbyint(50.0 * loop().pv[k]));
      }
    }
  }
  // Another column shows the decimal mark.
  CHECK(imported(grouped(".", ';', false, 500.0, ",5")).record.pv[0] ==
        std::nearbyint(500.0 * loop().pv[0]));
  CHECK(imported(grouped(",", ';', false, 500.0, ".25")).record.pv[0] ==
        std::nearbyint(500.0 * loop().pv[0]));
}

TEST_CASE("ambiguous decimal marks are asked for", "[import]") {
  for (const char* mark : {",", "."}) {
    const std::string text = grouped(mark, ';', false, 500.0);  // never below 1000
    const std::string what = failure(text);
    INFO(what);
    CHECK(what.find("export.csv:2:") != std::string::npos);
    CHECK(what.find("'FIC1.PV'") != std::string::npos);
    CHECK(what.find("--decimal comma") != std::string::npos);
    CHECK(what.find("--decimal point") != std::string::npos);
    CHECK(what.find("bad value") == std::string::npos);
    ImportOptions told;
    told.decimal = *mark == ',' ? '.' : ',';
    CHECK(imported(text, told).record.pv[0] == std::nearbyint(500.0 * loop().pv[0]));
  }
  // The first value of a thousand or more may be far down.
  std::string late = "Time;FIC1.PV;FIC1.OP\n";
  for (std::size_t k = 0; k < kSamples; ++k)
    late += iso(k) + ";" + (k < 700 ? std::to_string(300 + k) : "1.00" + std::to_string(k % 10)) +
            ";50\n";
  CHECK(failure(late).find("--decimal") != std::string::npos);
}

TEST_CASE("a hint offers no number as a bad value", "[import]") {
  std::string text = "Time;FIC1.PV;FIC1.OP\n";
  for (std::size_t k = 0; k < kSamples; ++k)
    text += iso(k) + ";" + number(loop().pv[k]) + "5;" +
            (k == 600 ? "50,25" : number(loop().co[k])) + "\n";
  const std::string what = failure(text);
  CHECK(what.find("export.csv:602:") != std::string::npos);
  CHECK(what.find("--decimal comma") != std::string::npos);
  CHECK(what.find("bad value") == std::string::npos);
}

TEST_CASE("qualities under the names of many vendors", "[import]") {
  struct Vendor {
    const char* header;
    const char* good;
    const char* bad;
  };
  for (const Vendor& v : {Vendor{"VarName;TimeString;VarValue;Validity", "1", "0"},
                          {"TagName;DateTime;Value;QualityDetail", "192", "24"},
                          {"TagName;DateTime;vValue;OPCQuality", "192", "0"},
                          {"Tag;Timestamp;Value;Questionable", "False", "True"},
                          {"TagId;TimeStr;Value;IQuality", "3", "65472"},
                          {"NAME;IP_TREND_TIME;IP_TREND_VALUE;IP_VALUE_QUALITY", "Good", "Bad"},
                          {"tagname;timestamp;value;confidence", "100", "0"},
                          {"Item;Time;Value;ValueStatus", "Good, Raw", "BadSensorFailure"},
                          {"Messstelle;Zeit;Wert;Qualit\u00e4t", "gut", "schlecht"},
                          {"variable;heure;valeur;Qualit\u00e9", "Bon", "Mauvais"},
                          {"variable;fecha;valor;calidad", "Buena", "Mala"},
                          {"tag;time;value;\u8d28\u91cf", "\u826f\u597d", "\u574f"},
                          {"tag;time;value;Jako\u015b\u0107", "Dobra", "Z\u0142a"},
                          {"tag;time;value;Laatu", "Hyv\u00e4", "Huono"},
                          {"tag;time;value;Quality OK", "1", "0"},
                          {"tag;time;value;SensorFault", "0", "1"},
                          {"tag;time;value;Rating", "GOOD", "COMM FAIL"},
                          {"path;t_stamp;value;quality", "Good (192)", "Bad_Stale"}}) {
    INFO(v.header);
    std::string text = std::string(v.header) + "\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      const bool bad = k >= 500 && k < 520;
      text += "FIC1.PV;" + iso(k) + ";" + (bad ? "0" : number(loop().pv[k]) + "5") + ";" +
              (bad ? v.bad : v.good) + "\n";
      text += "FIC1.OP;" + iso(k) + ";" + number(loop().co[k]) + ";" + v.good + "\n";
    }
    const Imported got = imported(text);
    CHECK(got.notes.bad + got.notes.questionable == 20);
    CHECK(numeric::missing(got.record.pv) == 20);
    CHECK(numeric::missing(got.record.co) == 0);
    CHECK(got.notes.layout.find("qualities in") != std::string::npos);
  }
}

TEST_CASE("qualities next to each value, of a loop and of a row", "[import]") {
  for (const char* header : {"Time,FIC1.PV,FIC1.PV Quality,FIC1.OP,FIC1.OP Quality",
                             "Time,FIC1.PV,Quality,FIC1.OP,Quality",
                             "Time,FIC1.PV,FIC1.PV_IsGood,FIC1.OP,FIC1.OP_IsGood",
                             "Time,FIC1.PV,Quality FIC1.PV,FIC1.OP,Quality FIC1.OP"}) {
    INFO(header);
    std::string text = std::string(header) + "\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      text += iso(k) + "," + number(loop().pv[k]) + (k == 7 ? ",0," : ",1,") +
              number(loop().co[k]) + (k == 9 ? ",0" : ",1") + "\n";
    }
    const Imported got = imported(text);
    CHECK(numeric::missing(got.record.pv) == 1);
    CHECK(numeric::missing(got.record.co) == 1);
    CHECK(std::isnan(got.record.pv[7]));
  }
  for (const char* header : {"Time,FIC1.PV,FIC1.OP,Validity", "Time,FIC1.PV,FIC1.OP,FIC1.Quality",
                             "Time,FIC1.PV,FIC1.OP,Status"}) {
    std::string text = std::string(header) + "\n";
    for (std::size_t k = 0; k < kSamples; ++k)
      text += iso(k) + "," + number(loop().pv[k]) + "," + number(loop().co[k]) +
              (k == 7 ? ",0" : ",1") + "\n";
    const Imported got = imported(text);
    CHECK(numeric::missing(got.record.pv) == 1);
    CHECK(numeric::missing(got.record.co) == 1);
  }
}

TEST_CASE("columns named as qualities with other content are ignored and reported", "[import]") {
  const auto with = [](const std::string& name, const auto& state) {
    std::string text = "Time,FIC1.PV,FIC1.OP," + name + "\n";
    for (std::size_t k = 0; k < kSamples; ++k)
      text +=
          iso(k) + "," + number(loop().pv[k]) + "," + number(loop().co[k]) + "," + state(k) + "\n";
    return text;
  };
  const auto pump = [](std::size_t k) {
    return k % 200 < 90 ? std::string("RUN") : std::string(k % 200 < 100 ? "FAULT" : "STOP");
  };
  const auto on = [](std::size_t k) { return std::string(k % 200 < 90 ? "1" : "0"); };
  const auto step = [](std::size_t k) { return std::to_string(k / 100 % 4); };
  const auto purity = [](std::size_t k) {
    return fmt::format("{:.1f}", 97.3 + 0.1 * static_cast<double>(k % 9));
  };
  const auto bits = [](std::size_t k) { return std::string(k == 7 ? "0x8000" : "0x0000"); };
  for (const std::string& text : {with("Status", pump), with("Status", on), with("State", step),
                                  with("Quality", purity), with("Flags", bits)}) {
    INFO(text.substr(0, 80));
    const Imported got = imported(text);
    CHECK(numeric::missing(got.record.pv) == 0);
    CHECK(numeric::missing(got.record.co) == 0);
    REQUIRE(got.notes.remarks.size() == 1);
    CHECK(got.notes.remarks.front().find("not used, because it has no state that is known") !=
          std::string::npos);
  }
}

TEST_CASE("the fixed format with qualities or thousands marks is not read as a plain record",
          "[import]") {
  std::string rated = "time,pv,co,quality\n";
  std::string marked = "time,pv,co\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    rated += seconds(k) + "," + number(loop().pv[k]) + "," + number(loop().co[k]) +
             (k == 7 ? ",Bad" : ",Good") + "\n";
    const long pv = 990 + static_cast<long>(k % 30);
    marked += seconds(k) + "," +
              (pv < 1000 ? std::to_string(pv) : fmt::format("1.{:03}", pv - 1000)) + ",35\n";
  }
  CHECK(numeric::missing(imported(rated).record.pv) == 1);
  CHECK(imported(marked).record.pv[15] == 1005.0);
}

TEST_CASE(
    "an unknown word of quality is reported, and a lack of good values is an error with its reason",
    "[import]") {
  const auto with = [](const std::string& usual, const std::string& odd) {
    std::string text = "Tag,Time,Value,Quality,Note\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      text +=
          "FIC1.PV," + iso(k) + "," + number(loop().pv[k]) + "," + (k < 12 ? odd : usual) + ",x\n";
      text += "FIC1.OP," + iso(k) + "," + number(loop().co[k]) + "," + usual + ",x\n";
    }
    return text;
  };
  const Imported got = imported(with("Good", "Wartung"));
  CHECK(numeric::missing(got.record.pv) == 12);
  REQUIRE(got.notes.remarks.size() == 1);
  CHECK(got.notes.remarks.front() ==
        "column 'Quality': 'Wartung' in 12 cells: not known, taken as bad");
  CHECK(numeric::missing(imported(with("Xo", "Bad")).record.pv) == 12);
  CHECK(failure(with("Bad", "Bad"))
            .find("no value of 'FIC1.PV' has a good quality in 'Quality', where most cells have "
                  "'Bad'. If these values are good, leave the column out of the export") !=
        std::string::npos);
  CHECK(got.notes.layout.find("; not used: 'Note'") != std::string::npos);
  const TemporaryFolder folder;
  write_file(folder / "e.csv", with("Good", "Bad"));
  CHECK(Importer({folder / "e.csv"}, {}).other_names() == std::vector<std::string>{"Note"});
}

TEST_CASE("numbered tags are mapped by their number", "[import]") {
  std::string text = "TagId;TimeInt;TimeStr;Value;IQuality\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::string times = std::to_string(kStart + static_cast<std::int64_t>(k)) + ";\"" +
                              date("02/03/2026 %H:%M:%S", k) + "\";";
    text += "1;" + times + number(loop().pv[k]) + "5;3\n2;" + times + number(loop().co[k]) + ";3\n";
  }
  ImportOptions mapped;
  mapped.loops = {{.tag = "", .names = {"1", "", "2", "", ""}, .units = {}}};
  const Imported got =
      imported(text, mapped);  // numbers since 1970 leave no ambiguity of day and month
  CHECK(got.record.co == loop().co);
  CHECK(got.notes.start->whole_s == kStart);
}

TEST_CASE("milliseconds and microseconds since any start, by name and by option", "[import]") {
  for (const auto& [name, scale] : {std::pair{"time_ms", 1000},
                                    {"t[ms]", 1000},
                                    {"millis", 1000},
                                    {"Time (ms)", 1000},
                                    {"time_us", 1000000},
                                    {"t (\u00b5s)", 1000000}}) {
    INFO(name);
    const auto time = [s = scale](std::size_t k) {
      return std::to_string(s * (87754 + static_cast<long>(k)));
    };
    same(imported(wide(std::string(name) + ",PV,OP,SP", time)));
  }
  const auto ms = [](std::size_t k) { return std::to_string(1000 * k); };
  for (const char* header : {"time,pv,co,sp", "tick,PV,OP,SP"}) {
    CHECK(failure(wide(header, ms)).find("--time seconds (1000 s) or --time milliseconds (1 s)") !=
          std::string::npos);
  }
  same(imported(wide("time,pv,co,sp", ms), with_time(TimeForm::milliseconds)));
  CHECK(imported(wide("time,pv,co,sp", ms), with_time(TimeForm::seconds)).record.period_s ==
        1000.0);
  CHECK(imported(wide("time_s,pv,co,sp", ms)).record.period_s == 1000.0);
}

TEST_CASE("units in cells are dropped, two units in a column refused", "[import]") {
  const auto with = [](const std::string& unit, const std::string& odd) {
    std::string text = "Time,FIC1.PV,FIC1.OP\n";
    for (std::size_t k = 0; k < kSamples; ++k)
      text += iso(k) + "," + number(loop().pv[k]) + (k == 700 ? odd : unit) + "," +
              number(loop().co[k]) + "%\n";
    return text;
  };
  const Imported got = imported(with(" \u00b0C", " \u00b0C"));
  CHECK(got.record.pv == loop().pv);
  CHECK(got.record.co == loop().co);
  CHECK(got.notes.units[index_of(Role::pv)] == "\u00b0C");
  CHECK(failure(with(" bar", " mbar")).find("'mbar', and other cells are in 'bar'") !=
        std::string::npos);
  CHECK(failure(with(" bar", "")).find("has no unit") != std::string::npos);
}

TEST_CASE("a clock that was not set, wrong stamps, and a clock set back", "[import]") {
  const auto with = [](const std::function<std::string(std::size_t)>& time, bool is_long) {
    std::string text = is_long ? "Tag,Time,Value\n" : "Time,FIC1.PV,FIC1.OP\n";
    for (std::size_t k = 0; k < kSamples; ++k) {
      const std::string pv = number(loop().pv[k]);
      const std::string co = number(loop().co[k]);
      text += is_long ? "FIC1.PV," + time(k) + "," + pv + "\nFIC1.OP," + time(k) + "," + co + "\n"
                      : time(k) + "," + pv + "," + co + "\n";
    }
    return text;
  };
  const auto epoch = [](std::int64_t s) { return std::to_string(s); };
  for (const bool is_long : {false, true}) {
    INFO(is_long);
    for (const bool numbers : {false, true}) {
      const auto unset = [&](std::size_t k) {
        const std::int64_t at =
            k < 90 ? 12 + static_cast<std::int64_t>(k) : kStart + static_cast<std::int64_t>(k);
        return numbers ? epoch(at) : iso_text(at, 0.0, true);
      };
      const Imported got = imported(with(unset, is_long));
      CHECK(got.record.size() == kSamples - 90);
      CHECK(got.record.pv[0] == loop().pv[90]);
      CHECK(got.notes.start->whole_s == kStart + 90);
      REQUIRE_FALSE(got.notes.remarks.empty());
      CHECK(got.notes.remarks.front().find("90 rows are left out") != std::string::npos);
      const auto wrong = [&](std::size_t k) {
        const std::int64_t at =
            k == 500 || k == 501 ? 4294967295 : kStart + static_cast<std::int64_t>(k);
        return numbers ? epoch(at) : iso_text(at, 0.0, true);
      };
      const Imported stamps = imported(with(wrong, is_long));
      CHECK(stamps.record.size() == kSamples);
      CHECK(numeric::missing(stamps.record.pv) == 2);
      CHECK(stamps.record.pv[502] == loop().pv[502]);
    }
    for (const char* zero : {"0001-01-01T00:00:00", "1601-01-01T00:00:00", "1899-12-30T00:00:00",
                             "9999-12-31T23:59:59"}) {
      INFO(zero);
      const auto zeros = [&](std::size_t k) { return k == 400 || k == 700 ? zero : iso(k); };
      const Imported got = imported(with(zeros, is_long));
      CHECK(got.record.size() == kSamples);
      CHECK(numeric::missing(got.record.pv) == 2);
      CHECK(got.record.pv[401] == loop().pv[401]);
    }
    const auto ahead = [](std::size_t k) { return iso(k == 600 ? k + 86400 : k); };
    CHECK(imported(with(ahead, is_long)).record.size() == kSamples);
    const std::string what =
        failure(with([](std::size_t k) { return iso(k < 450 ? k : k - 300); }, is_long));
    INFO(what);
    CHECK(what.find("the time decreases by 299 s") != std::string::npos);
    CHECK(what.find("the clock was set back") != std::string::npos);
    CHECK(what.find("ort the rows") == std::string::npos);
    CHECK(what.find("summer time") == std::string::npos);
    // It is unknown which half is right.
    const auto halves = [](std::size_t k) { return iso(k < 450 ? k : k + 2000UL * 86400); };
    CHECK(failure(with(halves, is_long)).find("export them as two files") != std::string::npos);
  }
}

TEST_CASE("rows of a value in any order are sorted, and repeated values are accepted", "[import]") {
  std::string text = "Tag,Time,Value\n";
  const auto rows = [&](const char* tag, const std::vector<double>& values, std::size_t from,
                        std::size_t to) {
    for (std::size_t k = from; k < to; ++k)
      text += std::string(tag) + "," + iso(k) + "," + number(values[k]) + "\n";
  };
  rows("FIC1.PV", loop().pv, 400, kSamples);
  rows("FIC1.PV", loop().pv, 0, 450);
  rows("FIC1.OP", loop().co, 0, kSamples);
  const Imported got = imported(text);
  CHECK(got.record.pv == loop().pv);
  CHECK(got.record.co == loop().co);
}

TEST_CASE("InfluxDB's line protocol is read by series", "[import]") {
  std::string text = "# DML\n\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    const std::string at = std::to_string(1000000000 * (kStart + static_cast<std::int64_t>(k)));
    text += "modbus,host=box,unit=1 FIC101.PV=" + number(loop().pv[k]) +
            ",FIC101.OP=" + number(loop().co[k]) + ",FIC101.SP=" + number(loop().sp[k]) +
            ",note=\"a, b=c\" " + at + "\n";
    text += "pump,host=box,unit=2 run=true,rpm=1450i " + at + "\n";
  }
  const Imported got = imported(text, {}, "export.txt");
  same(got);
  CHECK(got.notes.start->whole_s == kStart);
  CHECK(got.notes.layout.find("line protocol") != std::string::npos);
  CHECK(imported(text, {}, "export.txt", "FIC101").record.size() == kSamples);
  ProtocolLine line;
  CHECK(
      parse_protocol_line(R"(my\ plant,a\,b=c\=d PV=1.5,n=-3i,u=7u,ok=T,s="x\"y, z=1" 12)", line));
  CHECK(line.measurement == "my plant");
  CHECK(line.tags == std::vector<std::pair<std::string, std::string>>{{"a,b", "c=d"}});
  CHECK(line.fields ==
        std::vector<std::pair<std::string, std::string>>{
            {"PV", "1.5"}, {"n", "-3"}, {"u", "7"}, {"ok", "1"}, {"s", "x\"y, z=1"}});
  CHECK(line.time == "12");
  for (const char* none :
       {"time,pv,co", "1,2,3", "a b", "a b=", "a b=1 x", "a,b c=1 2", "a b=\"x 3", ""})
    CHECK_FALSE(parse_protocol_line(none, line));
  CHECK(failure("m a=1 1\nm a=2 2\nm a=3 3\nnothing\nm a=1 5\n").find("export.csv:4: is no line") !=
        std::string::npos);
  CHECK(failure("m PV=1\nm PV=2\nm PV=3\n").find("export.csv:1: a line without a time") !=
        std::string::npos);
}

TEST_CASE("qualities in InfluxDB's line protocol, as a field, a tag, or per field", "[import]") {
  struct Form {
    const char* pv;
    const char* co;
  };
  for (const Form& form :
       {Form{"o,name=FIC1.PV value={},quality=\"{}\" {}\n",
             "o,name=FIC1.OP value={},quality=\"{}\" {}\n"},
        {"o,name=FIC1.PV,quality={1} value={0} {2}\n",
         "o,name=FIC1.OP,quality={1} value={0} {2}\n"},
        {"FIC1 PV={},PV_quality=\"{}\" {}\n", "FIC1 OP={},OP_quality=\"{}\" {}\n"}}) {
    INFO(form.pv);
    std::string text;
    for (std::size_t k = 0; k < kSamples; ++k) {
      const std::int64_t at = 1000000000 * (kStart + static_cast<std::int64_t>(k));
      text += fmt::format(fmt::runtime(form.pv), number(loop().pv[k]),
                          k >= 500 && k < 520 ? "Bad" : "Good", at);
      text += fmt::format(fmt::runtime(form.co), number(loop().co[k]), "Good", at);
    }
    const Imported got = imported(text, {}, "export.lp");
    CHECK(numeric::missing(got.record.pv) == 20);
    CHECK(numeric::missing(got.record.co) == 0);
  }
}

TEST_CASE("an output stepped in manual stays as it was logged", "[import]") {
  for (const double round : {5.0, 1.0, 0.5, 0.001}) {
    for (const std::uint64_t seed : {3UL, 4UL, 5UL}) {
      numeric::Random random(seed);
      std::vector<double> co;
      std::string text = "Time,FIC1.PV,FIC1.OP\n";
      double at = 40.0;
      double pv = 20.0;
      while (co.size() < 3000) {
        const auto hold = static_cast<std::size_t>(random.uniform(20.0, 90.0));
        for (std::size_t k = 0; k < hold; ++k) {
          pv += 0.1 * (0.5 * at - pv);
          text +=
              iso(co.size()) + "," + number(pv + 0.02 * random.normal()) + "," + number(at) + "\n";
          co.push_back(std::nearbyint(1e3 * at) / 1e3);
        }
        const double move = random.uniform(2.0, 12.0) * (random.uniform() < 0.5 ? -1.0 : 1.0);
        at = round * std::nearbyint(std::clamp(at + move, 10.0, 90.0) / round);
      }
      const Imported got = imported(text);
      INFO(round << " " << seed);
      CHECK_FALSE(got.notes.compressed());
      CHECK(got.notes.resampled.empty());
      CHECK(got.record.co == co);
    }
  }
}

TEST_CASE("modes show the samples in automatic", "[import]") {
  std::string text = "Timestamp,FIC101.PV,FIC101.OP,FIC101.SP,FIC101.MODE\n";
  for (std::size_t k = 0; k < kSamples; ++k) {
    text += iso(k) + ",1" + std::to_string(k % 7) + ",2" + std::to_string(k % 5) + ",3," +
            (k < 100   ? "MAN"
             : k < 200 ? "Cascade"
                       : "AUTO") +
            "\n";
  }
  const Imported got = imported(text);
  CHECK(!got.record.automatic.empty());
  CHECK(got.record.automatic[50] == 0.0);
  CHECK(got.record.automatic[150] == 1.0);
  CHECK(got.record.automatic[250] == 1.0);
}

TEST_CASE("a file that is no export is reported as such", "[import]") {
  ImportOptions semicolon;
  semicolon.delimiter = ';';
  CHECK(failure(wide("time,pv,co,sp", seconds), semicolon).find("are separated by ';'") !=
        std::string::npos);
  ImportOptions column;
  column.time_column = "Zeit";
  CHECK(failure(wide("time,pv,co,sp", seconds), column).find("the first line has 'time', 'pv'") !=
        std::string::npos);
  CHECK(failure("").find("empty") != std::string::npos);
  for (const char* header : {"Time,PV,OP\n", "Time,PV,OP\ns,m3/h,%\n"}) {
    CHECK(failure(header).find("a header without a row of data below it") != std::string::npos);
  }
  // At the first row.
  CHECK(failure(wide("Timestamp,PV,OP,SP",
                     [](std::size_t k) { return date("%a %H:%M:%S week %V of %Y", k); }))
            .find("export.csv:2:1: 'Sun 22:30:00 week 09 of 2026' is no time that is known") !=
        std::string::npos);
  CHECK_FALSE(failure("one column\n1\n2\n").empty());
  CHECK(failure("a,b,c\nx,y,z\nx,y,z\n").find("--time-column") != std::string::npos);
  CHECK_FALSE(failure(std::string("\x89PNG\r\n\x1a\n\0\0\0\rIHDR", 16)).empty());
  CHECK(failure("Timestamp,A,B\n2026-03-01T10:00:00Z,1,2\n2026-03-01T10:00:01Z,1,2\n")
            .find("--map pv=NAME") != std::string::npos);
  CHECK_THROWS_AS(import_record("/nonexistent.csv", "", {}), RecordError);
}

}  // namespace
}  // namespace loopwarden::tests::importer_test
