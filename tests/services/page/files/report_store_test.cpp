// SPDX-License-Identifier: Apache-2.0
#include "services/page/files/report_store.hpp"

#include <catch2/catch.hpp>
#include <sys/stat.h>

#include <algorithm>
#include <array>

#include "tests/support/device/foreign_process.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::tests::report_store_test {

using namespace page::files;

std::string html(const std::string& title) {
  return "<!doctype html><html><head><title>" + title + "</title></head></html>";
}

// Folders whose names only resemble those of requested reports.
constexpr std::array kNotAsked{"-x-y",
                               "-gap-20261126T100000000Z",
                               "FIC-1-notes-20261126T100000000Z",
                               "FIC-1-gap-20261126",
                               "FIC-1-gap-old",
                               "my own-gap-20261126T100000000Z",
                               "visit-by-vendor"};

TEST_CASE("reports below the state directory, by kind, title and loop") {
  const TemporaryFolder folder;
  write_file(folder / "evidence/20261124T070000000Z-FIC-101-stiction/report.html",
             html("Gap: FIC-101 &lt;a&gt;"));
  write_file(folder / "gap/report.html", html("Gap: boiler"));
  write_file(folder / "trained/training.html", html("Errors"));
  write_file(folder / "twins/FIC-7/report.html", html("Commissioning of FIC-7"));
  write_file(folder / "plant/survey.html", html("Survey"));
  write_file(folder / "notes.html", "no title");
  write_file(folder / "reports/FIC-102-diagnose-20261126T100000000Z/report.html", html("FIC-102"));
  write_file(folder / "reports/FIC-1-gap-20261126T100000000Z/report.html", html("Gap: r.csv"));
  write_file(folder / "reports/P-1-A-commission-20261126T100000000Z/report.html", html("P-1-A"));
  write_file(folder / "reports/mine/report.html", html("Mine"));
  for (const char* odd : kNotAsked) {
    write_file(folder / "reports" / odd / "report.html", html(odd));
  }
  write_file(folder / "evidence/kept-FIC-9-by-me/report.html", html("Kept"));
  write_file(folder / "segments/FIC-101/x.html", html("not looked for"));
  write_file(folder / ".hidden/x.html", html("hidden"));
  std::filesystem::create_symlink("/etc", folder / "link");
  ReportStore store(folder.path());
  const auto list = store.reports();
  const auto& reports = *list;
  REQUIRE(reports.size() == 18);
  const auto kind = [&](const std::string& title) {
    const auto it = std::find_if(reports.begin(), reports.end(),
                                 [&](const Report& report) { return report.title == title; });
    return it == reports.end() ? "missing" : it->kind + " " + it->loop;
  };
  CHECK(kind("Gap: FIC-101 <a>") == "explanation FIC-101");
  CHECK(kind("Gap: boiler") == "gap ");
  CHECK(kind("Errors") == "training ");
  CHECK(kind("Commissioning of FIC-7") == "commissioning ");
  CHECK(kind("Survey") == "survey ");
  CHECK(kind("notes.html") == "other ");
  CHECK(kind("FIC-102") == "diagnosis FIC-102");
  CHECK(kind("Gap: r.csv") == "gap FIC-1");
  CHECK(kind("Mine") == "other ");
  CHECK(kind("P-1-A") == "commissioning P-1-A");
  for (const char* odd : kNotAsked) {
    CHECK(kind(odd) == "other ");
  }
  CHECK(kind("Kept") == "explanation ");
  CHECK(std::is_sorted(reports.begin(), reports.end(),
                       [](const Report& a, const Report& b) { return a.utc_ms > b.utc_ms; }));
}

TEST_CASE("a report and the files next to it are read by the report's id") {
  const TemporaryFolder folder;
  write_file(folder / "plant/survey.html", html("Survey"));
  write_file(folder / "plant/assets/survey.css", "b {}");
  write_file(folder / "plant/secret.key", "secret");
  write_file(folder / "users", "secret");
  ReportStore store(folder.path());
  const std::string id = store.reports()->at(0).id;
  ReportStore fresh(folder.path());
  CHECK(fresh.name(id) == "survey.html");
  CHECK(fresh.read(id, {"survey.html"})->type == "text/html; charset=utf-8");
  CHECK_FALSE(fresh.read(id, {}));
  CHECK(store.read(id, {"assets", "survey.css"})->bytes == "b {}");
  CHECK_FALSE(store.read(id, {"secret.key"}));
  CHECK_FALSE(store.read(id, {"..", "users"}));
  CHECK_FALSE(store.read(id, {"assets"}));
  CHECK_FALSE(store.read("0000000000000000", {"survey.html"}));
}

TEST_CASE("files newer than the index appear in the next index, and no request makes it earlier") {
  const TemporaryFolder folder;
  write_file(folder / "gap/report.html", html("Gap: boiler"));
  ReportStore lasting(folder.path(), std::chrono::hours(1));
  CHECK(lasting.reports()->size() == 1);
  write_file(folder / "gap2/report.html", html("Gap: reflux"));
  ReportStore other(folder.path());
  std::string id;
  for (const Report& report : *other.reports()) {
    if (report.title == "Gap: reflux") id = report.id;
  }
  REQUIRE(other.name(id) == "report.html");
  CHECK_FALSE(lasting.name(id));
  CHECK_FALSE(lasting.read(id, {"report.html"}));
  CHECK(lasting.reports()->size() == 1);
  ReportStore brief(folder.path(), std::chrono::milliseconds(0));
  CHECK(brief.reports()->size() == 2);
  write_file(folder / "gap3/report.html", html("Gap: quench"));
  CHECK(test::eventually([&] { return brief.reports()->size() == 3; }));
}

TEST_CASE("links and special files give no access to other folders") {
  const TemporaryFolder folder;
  write_file(folder / "secret.html", html("outside"));
  write_file(folder / "state/evidence/one/evidence.json", "{}");
  std::filesystem::create_symlink(folder / "secret.html", folder / "state/evidence/one/link.html");
  std::filesystem::create_symlink(folder.path(), folder / "state/evidence/up");
  REQUIRE(::mkfifo((folder / "state/evidence/one/pipe.html").c_str(), 0600) == 0);
  ReportStore store(folder / "state");
  CHECK(store.reports()->empty());
  CHECK(store.evidence_file("one", "evidence.json") == "{}");
  CHECK(store.evidence_files("one") == std::vector<std::string>{"evidence.json"});
  for (const char* id : {"", ".", "..", "up", "one/..", "../state", "/etc"}) {
    CHECK_FALSE(store.evidence_file(id, "secret.html"));
    CHECK(store.evidence_files(id).empty());
  }
  // The evidence of an alarm that joined an incident is in the folder of the alarm that opened it.
  write_file(folder / "state/evidence/one/two/evidence.json", "{}");
  CHECK(store.evidence_file("two", "evidence.json") == "{}");
  CHECK(store.evidence_folder("two") == folder / "state/evidence/one/two");
  CHECK_FALSE(store.evidence_file("one", "link.html"));
  CHECK_FALSE(store.evidence_file("one", "pipe.html"));
  CHECK_FALSE(store.evidence_file("one", "../one/evidence.json"));
}

}  // namespace loopwarden::tests::report_store_test
