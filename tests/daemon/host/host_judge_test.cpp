// SPDX-License-Identifier: Apache-2.0
#include "daemon/host/host_judge.hpp"

#include <catch2/catch.hpp>

#include "base/clock.hpp"
#include "daemon/host/host_probe.hpp"
#include "daemon/host/certificate_file.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::host_judge_test {

using alarm::BoxAlarm;
using alarm::index_of;
using host::BoxLook;
using host::BoxReport;
using host::HostJudge;

namespace {

constexpr std::int64_t kStart_ms = 1'800'000'000'000;

BoxLook healthy(std::int64_t monotonic_ms) {
  return {.monotonic_ms = monotonic_ms,
          .utc_ms = kStart_ms + monotonic_ms,
          .disk = host::DiskLook{.room_bytes = 1'000'000'000},
          .failed_services = std::vector<std::string>{},
          .writes = {.bytes = 1'000, .per_day_b = 1e6, .full_hour = true},
          .write_budget_b = 1e6};
}

// Makes a self-signed certificate.
void make_certificate(const std::string& file, int days) {
  REQUIRE(tests::run("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:P-256 -nodes -days " +
                     std::to_string(days) + " -subj /CN=box -keyout /dev/null -out " + file +
                     " 2>/dev/null")
              .exit_code == 0);
}

bool on(const BoxReport& report, BoxAlarm kind) { return report.found[index_of(kind)].value(); }
std::string why(const BoxReport& report, BoxAlarm kind) { return report.why[index_of(kind)]; }

}  // namespace

TEST_CASE("a healthy host has no alarm", "[box]") {
  HostJudge judge;
  for (std::int64_t t = 0; t < 50'000; t += 5'000) {
    const BoxReport report = judge.judge(healthy(t));
    for (const BoxAlarm kind : alarm::kBoxAlarms) {
      CHECK_FALSE(on(report, kind));
      CHECK(why(report, kind).empty());
    }
  }
}

TEST_CASE("a disk without room, or one that the journal can't write on", "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.disk->room_bytes = 99'999'999;
  CHECK(on(judge.judge(look), BoxAlarm::disk_full));
  CHECK(why(judge.judge(look), BoxAlarm::disk_full) == "99 MB are left");
  look.disk->room_bytes = 1'000'000'000;
  look.journal_error = "disk I/O error";
  CHECK(why(judge.judge(look), BoxAlarm::disk_full) == "the journal can't write: disk I/O error");
  look.journal_error.clear();
  look.disk->room_bytes.reset();
  CHECK_FALSE(judge.judge(look).found[index_of(BoxAlarm::disk_full)]);
}

TEST_CASE(
    "a hung disk is reported after 10 s; conditions that only it knows are not reported meanwhile",
    "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.disk.reset();
  look.disk_wait_s = 9.9;
  CHECK_FALSE(judge.judge(look).found[index_of(BoxAlarm::disk_full)]);
  look.disk_wait_s = 10.0;
  CHECK(on(judge.judge(look), BoxAlarm::disk_full));
  CHECK(why(judge.judge(look), BoxAlarm::disk_full) == "the disk has not answered for 10 s");
  CHECK_FALSE(judge.judge(look).found[index_of(BoxAlarm::certificate_expires)]);
  CHECK_FALSE(on(judge.judge(look), BoxAlarm::feeder_lost));
}

TEST_CASE("a clock that is set is reported for ten minutes; a slewed one is not", "[box]") {
  HostJudge judge;
  judge.judge(healthy(0));
  BoxLook look = healthy(5'000);
  look.utc_ms += 900;
  CHECK_FALSE(on(judge.judge(look), BoxAlarm::clock_stepped));
  look = healthy(10'000);
  look.utc_ms -= 3'600'000;
  const BoxReport report = judge.judge(look);
  CHECK(on(report, BoxAlarm::clock_stepped));
  CHECK(why(report, BoxAlarm::clock_stepped) == "the clock was set by -3600.9 s");
  look.monotonic_ms += 599'999;
  look.utc_ms += 599'999;
  CHECK(on(judge.judge(look), BoxAlarm::clock_stepped));
  look.monotonic_ms += 1;
  look.utc_ms += 1;
  CHECK_FALSE(on(judge.judge(look), BoxAlarm::clock_stepped));
}

TEST_CASE("feeders and services are named; without systemd no service is reported", "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.lost_feeders = {{.what = "opcua", .loops = {"FIC-101", "FIC-102"}}, {.what = "mqtt"}};
  look.failed_services = {"loopwarden-page.service"};
  const BoxReport report = judge.judge(look);
  CHECK(why(report, BoxAlarm::feeder_lost) == "opcua: FIC-101, FIC-102; mqtt");
  CHECK(why(report, BoxAlarm::service_failed) == "loopwarden-page.service");
  HostJudge without_systemd;
  look.failed_services.reset();
  CHECK_FALSE(on(without_systemd.judge(look), BoxAlarm::service_failed));
}

TEST_CASE("a lost connection names its loops, at most eight", "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  CHECK_FALSE(on(judge.judge(look), BoxAlarm::connection_lost));
  host::LostConnection edge{.what = "edge node plant/e1 (mqtt)"};
  for (int n = 101; n < 111; ++n) edge.loops.push_back("FIC-" + std::to_string(n));
  look.lost_connections = {edge};
  const BoxReport report = judge.judge(look);
  CHECK(on(report, BoxAlarm::connection_lost));
  CHECK(why(report, BoxAlarm::connection_lost) ==
        "edge node plant/e1 (mqtt): FIC-101, FIC-102, FIC-103, FIC-104, FIC-105, FIC-106, FIC-107, "
        "FIC-108 and 2 more loops");
  CHECK_FALSE(report.output_behind);
}

TEST_CASE("a service that fails again and again is reported while it runs in between", "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.failed_services = {"loopwarden-page.service"};
  CHECK(on(judge.judge(look), BoxAlarm::service_failed));
  CHECK(why(judge.judge(healthy(19'999)), BoxAlarm::service_failed) == "loopwarden-page.service");
  CHECK_FALSE(on(judge.judge(healthy(20'000)), BoxAlarm::service_failed));
}

TEST_CASE("if systemd runs and can't be asked about configured services, this is reported",
          "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.failed_services.reset();
  look.has_services = true;
  CHECK_THAT(why(judge.judge(look), BoxAlarm::service_failed), Catch::Contains("package dbus"));
  CHECK(on(judge.judge(look), BoxAlarm::service_failed));
}

TEST_CASE("parts of the daemon that failed are named with their reason, also without systemd",
          "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.failed_services.reset();
  look.failed_parts = {"control.sock: no room", "feed.sock: no room"};
  CHECK(on(judge.judge(look), BoxAlarm::service_failed));
  CHECK(why(judge.judge(look), BoxAlarm::service_failed) ==
        "control.sock: no room, feed.sock: no room");
  look.failed_parts.clear();
  CHECK_FALSE(on(judge.judge(look), BoxAlarm::service_failed));
}

TEST_CASE("cycles that were dropped before the start are not reported", "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.dropped = 7;
  CHECK_FALSE(on(judge.judge(look), BoxAlarm::records_dropped));
  look = healthy(5'000);
  look.dropped = 8;
  CHECK(on(judge.judge(look), BoxAlarm::records_dropped));
  look = healthy(606'000);
  look.dropped = 8;
  CHECK_FALSE(on(judge.judge(look), BoxAlarm::records_dropped));
}

TEST_CASE("writes above the budget are reported after a whole hour of them", "[box]") {
  HostJudge judge;
  BoxLook look = healthy(0);
  look.writes.per_day_b = 2.5e9;
  look.write_budget_b = 465e6;
  CHECK(why(judge.judge(look), BoxAlarm::disk_writes) ==
        "2500 MB a day in the last hour, the budget is 465 MB");
  look.writes.full_hour = false;
  CHECK_FALSE(judge.judge(look).found[index_of(BoxAlarm::disk_writes)]);
}

TEST_CASE("a certificate that ends within 14 days, has ended, or can't be read", "[box]") {
  HostJudge judge;
  const auto told = [&](std::optional<std::int64_t> ends_s) {
    BoxLook look = healthy(0);
    look.disk->certificates = {{"box.pem", ends_s}};
    return why(judge.judge(look), BoxAlarm::certificate_expires);
  };
  constexpr std::int64_t kDay_s = 24 * 3600;
  CHECK(told(kStart_ms / 1000 + 14 * kDay_s).empty());
  CHECK(told(kStart_ms / 1000 + 14 * kDay_s - 1) == "box.pem ends in 13 days");
  CHECK(told(kStart_ms / 1000 - 1) == "box.pem has ended");
  CHECK(told(std::nullopt) == "box.pem can't be read");
}

TEST_CASE("the end of a certificate is read from its file", "[box]") {
  const tests::TemporaryFolder folder;
  const std::string file = (folder / "box.pem").string();
  make_certificate(file, 10);
  const auto ends_s = host::end_of_certificate(file);
  REQUIRE(ends_s);
  const std::string end = tests::run("date -u -d \"$(openssl x509 -enddate -noout -in " + file +
                                     " | cut -d= -f2)\" +%s")
                              .text;
  CHECK(*ends_s == std::stoll(end));
  tests::write_file(folder / "no.pem", "no certificate\n");
  CHECK_FALSE(host::end_of_certificate((folder / "no.pem").string()));
  CHECK_FALSE(host::end_of_certificate((folder / "missing.pem").string()));
}

TEST_CASE("a renewed certificate is not reported any more at the next look", "[box]") {
  const tests::TemporaryFolder folder;
  const std::string file = (folder / "box.pem").string();
  HostJudge judge;
  const auto told = [&] {
    BoxLook look = healthy(0);
    look.utc_ms = base::utc_ms();
    look.disk = host::look_at_disk(folder.path(), {file});
    CHECK(look.disk->room_bytes);
    return on(judge.judge(look), BoxAlarm::certificate_expires);
  };
  make_certificate(file, 10);
  CHECK(told());
  make_certificate(file, 100);
  CHECK_FALSE(told());
}

}  // namespace loopwarden::daemon::host_judge_test
