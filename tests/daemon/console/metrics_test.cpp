// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/metrics.hpp"

#include <catch2/catch.hpp>
#include <filesystem>
#include <sstream>
#include <string>

#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::metrics_test {
namespace {

std::string text() {
  const protocol::Histogram histogram{.sum = 40.0, .bins = {5, 3, 0, 2}};
  const protocol::DaemonStatus daemon{.version = "1.2",
                                      .recorder = {.disk_wait_s = 61.5},
                                      .log_lines_lost = 3,
                                      .journal = {.waiting = 4},
                                      .uptime_s = 12.5,
                                      .real_time_missing = "memory",
                                      .ticks = 10,
                                      .overruns = 1,
                                      .skipped_ticks = 2,
                                      .wake_up_us = histogram,
                                      .work_us = histogram};
  const protocol::LoopStatus loop{
      .name = "FIC\"101\\",
      .io = {.connected = false, .timeouts = 7},
      .recording = {.dropped = 3, .queue_dropped = 7},
      .monitor = {.windows = 12, .oscillation_index = 1.5, .condition = {.valve = 37.5}},
      .alarms = {{"stiction", {.active = true}}, {"backlash", {.active = false}}},
      .orders_refused = 2,
      .cycle = protocol::Cycle{.sp = 5.5,
                               .mode = "FALLBACK",
                               .fault = "bad PV",
                               .pv_age_ms = 250.0,
                               .jacket = {.form = "bounded", .rate = 0.25},
                               .compensator = {.kind = "knocker", .added = -0.5}}};
  return metrics_text(daemon, 1, [&](std::size_t) { return loop; });
}

TEST_CASE("the metrics have the values of the status, in base units", "[metrics]") {
  const std::string all = "\n" + text();
  const auto has = [&](const std::string& line) {
    INFO(line);
    CHECK(all.find("\n" + line + "\n") != std::string::npos);
  };
  const std::string loop = R"(loop="FIC\"101\\")";
  has("loopwarden_build_info{version=\"1.2\"} 1");
  has("loopwarden_overruns_total 1");
  has("loopwarden_real_time_rights 0");
  has("loopwarden_journal_waiting 4");
  has("loopwarden_recorder_disk_wait_seconds 61.5");
  has("loopwarden_log_lines_lost_total 3");
  has("loopwarden_recording_queue_dropped_total{" + loop + "} 7");
  has("loopwarden_input_age_seconds{" + loop + ",input=\"process_variable\"} 0.25");
  has("loopwarden_fault{" + loop + ",fault=\"bad PV\"} 1");
  has("loopwarden_automatic{" + loop + "} 0");
  has("loopwarden_set_point{" + loop + "} 5.5");
  has("loopwarden_jacket_rate{" + loop + "} 0.25");
  has("loopwarden_compensator_added{" + loop + "} -0.5");
  has("loopwarden_orders_refused_total{" + loop + "} 2");
  has("loopwarden_bus_timeouts_total{" + loop + "} 7");
  has("loopwarden_bus_connected{" + loop + "} 0");
  has("loopwarden_alarm_active{" + loop + ",alarm=\"stiction\"} 1");
  has("loopwarden_alarm_active{" + loop + ",alarm=\"backlash\"} 0");
  has("loopwarden_condition_index{" + loop + ",of=\"valve\"} 37.5");
  has("loopwarden_oscillation_index{" + loop + "} 1.5");
  has("loopwarden_windows_total{" + loop + "} 12");
  // A histogram is cumulative, and its last bin has no upper edge.
  has("loopwarden_wake_up_seconds_bucket{le=\"2e-06\"} 5");
  has("loopwarden_wake_up_seconds_bucket{le=\"4e-06\"} 8");
  has("loopwarden_wake_up_seconds_bucket{le=\"8e-06\"} 8");
  has("loopwarden_wake_up_seconds_bucket{le=\"+Inf\"} 10");
  has("loopwarden_wake_up_seconds_sum 4e-05");
  has("loopwarden_wake_up_seconds_count 10");
  // An unknown value is left out; no number replaces it.
  CHECK(all.find("loopwarden_process_variable{") == std::string::npos);
  CHECK(all.find("input=\"valve_position\"") == std::string::npos);
  CHECK(all.find("of=\"environment\"") == std::string::npos);
  CHECK(all.find("loopwarden_valve_stick_percent{") == std::string::npos);
  CHECK(all.find("nan") == std::string::npos);
}

TEST_CASE("a loop without a cycle has neither fault nor mode in the metrics", "[metrics]") {
  const std::string all =
      metrics_text({}, 1, [](std::size_t) { return protocol::LoopStatus{.name = "FIC-101"}; });
  CHECK(all.find("loopwarden_orders_refused_total{loop=\"FIC-101\"} 0\n") != std::string::npos);
  CHECK(all.find("loopwarden_fault{") == std::string::npos);
  CHECK(all.find("loopwarden_automatic{") == std::string::npos);
  CHECK(all.find("input=\"process_variable\"") == std::string::npos);
}

TEST_CASE("each family of metrics is announced once, before its samples", "[metrics]") {
  std::istringstream lines(text());
  std::string family;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("# HELP ", 0) == 0) {
      family = line.substr(7, line.find(' ', 7) - 7);
    } else if (line[0] != '#') {
      CHECK(line.rfind(family, 0) == 0);
    }
  }
}

TEST_CASE("the file of metrics is replaced as a whole, or not at all", "[metrics]") {
  const tests::TemporaryFolder folder;
  CHECK(write_metrics(folder / "metrics.prom", "a 1\n"));
  CHECK(write_metrics(folder / "metrics.prom", "b 2\n"));
  CHECK(tests::read_file(folder / "metrics.prom") == "b 2\n");
  CHECK_FALSE(std::filesystem::exists(folder / "metrics.prom.tmp"));
  CHECK_FALSE(write_metrics(folder / "no" / "metrics.prom", "c 3\n"));
}

}  // namespace
}  // namespace loopwarden::daemon::metrics_test
