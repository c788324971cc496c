// SPDX-License-Identifier: Apache-2.0
#include "workbench/records/recorder_input.hpp"

#include <atomic>
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <thread>

#include "base/local_server.hpp"
#include "base/thread.hpp"
#include "config/loop_model_reader.hpp"
#include "record/import/time_text.hpp"
#include "record/record_csv.hpp"
#include "record/segment_reader.hpp"
#include "record/segment_ring.hpp"
#include "tests/support/shell.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::workbench::recorder_input_test {
namespace {

using tests::run;
using tests::ShellOutcome;

// A daemon with one loop and a recorded simulated run of it. It answers `describe`.
class RecordedLoop {
 public:
  explicit RecordedLoop(protocol::Range pv_range) {
    tests::write_file(
        folder_ / "m.yaml",
        "sample_time: 1\n"
        "controller: {kp: 1.0, ki: 0.1, output: [0, 100]}\n"
        "process: {gain: 0.36, time_constant: 8.0, dead_time: 2.0}\n"
        "transmitter: {range: [0, 40], resolution: 0.001, noise: 0.04}\n"
        "scenario: {duration: 1500, set_point: [[0, 18], [200, 22], [500, 16], [800, 21], "
        "[1100, 17]]}\n");
    REQUIRE(loopwarden("simulate " + path("m.yaml") + " --out " + path("r.csv")).exit_code == 0);
    write_segments();
    protocol::Description box;
    protocol::LoopDescription& one = box.loops.emplace_back();
    one.tag = "FIC-205";
    one.sample_time_s = 1.0;
    one.recording = true;
    one.folder = path("FIC-205");
    one.pv_range = pv_range;
    one.co_range = {0.0, 100.0};
    nlohmann::json answer = box;
    answer["ok"] = true;
    answer_ = answer.dump();
    thread_.start({.name = "one-answer", .stack_bytes = 1024UL * 1024UL}, [this] { serve(); });
    while (!listening_) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  RecordedLoop(const RecordedLoop&) = delete;
  RecordedLoop& operator=(const RecordedLoop&) = delete;
  ~RecordedLoop() {
    quit_ = true;
    thread_.join();
  }

  std::string path(const std::string& name) const { return (folder_ / name).string(); }
  ShellOutcome loopwarden(const std::string& arguments) const {
    return run("LOOPWARDEN_SOCKET=" + path("s.sock") + " " LOOPWARDEN_CLI " " + arguments +
               " 2>&1");
  }
  // Returns UTC, the given seconds after the first sample.
  std::string at(std::int64_t seconds) const {
    const record::Segment first =
        record::read_segment(folder_ / "FIC-205" / record::segment_name(1));
    return record::iso_text(first.header.start_utc_ns / 1'000'000'000 + seconds, 0.0, true);
  }
  ShellOutcome of_recorder(const std::string& command) const {
    return loopwarden(command + " --loop FIC-205 --last 4h --out " + path("out"));
  }

 private:
  void write_segments() const {
    const record::Record r = record::read_record(folder_ / "r.csv");
    record::SegmentWriter writer(
        {.folder = folder_ / "FIC-205", .loop = "FIC-205", .period_s = r.period_s});
    for (std::size_t k = 0; k < r.size(); ++k) {
      record::RecordRow row;
      row.period_index = k;
      row.time_ns = static_cast<std::int64_t>(k) * 1'000'000'000;
      row.sp = r.sp[k];
      row.pv = r.pv[k];
      row.co = r.co[k];
      row.stem = std::nan("");
      row.mode = control::Mode::automatic;
      writer.append({&row, 1});
    }
  }
  void serve() {
    base::LocalServer server;
    server.listen({.path = path("s.sock")}, [this](std::string_view, unsigned) { return answer_; });
    listening_ = true;
    while (!quit_) server.serve(std::chrono::milliseconds(20));
  }

  tests::TemporaryFolder folder_;
  std::string answer_;
  std::atomic<bool> listening_{false}, quit_{false};
  base::Thread thread_;
};

}  // namespace

TEST_CASE("a time is a number with its unit", "[records]") {
  CHECK(seconds_of("4h") == 14'400.0);
  CHECK(seconds_of("90min") == 5400.0);
  CHECK(seconds_of("1.5d") == 129'600.0);
  CHECK(seconds_of("45s") == 45.0);
  for (const char* wrong : {"", "4", "h", "0h", "-1h", "4 h", "4hours", "infh", "nanh", "4h "}) {
    INFO(wrong);
    CHECK_FALSE(seconds_of(wrong));
  }
}

TEST_CASE("a model identified by gap has the daemon's ranges", "[records][program]") {
  const RecordedLoop loop({0.0, 40.0});
  const ShellOutcome made = loop.of_recorder("gap");
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  CHECK(tests::read_file(loop.path("out/model.assumed.yaml"))
            .find("PV runs from 0 to 40, as given") != std::string::npos);
  const auto model = config::read_model_file(loop.path("out/model.assumed.yaml"));
  REQUIRE(model);
  CHECK(model->transmitter.high == 40.0);
}

TEST_CASE("commission measures moves by the daemon's range", "[records][program]") {
  const RecordedLoop loop({0.0, 4000.0});
  const ShellOutcome made = loop.of_recorder("commission");
  INFO(made.text);
  CHECK(made.exit_code == 0);
  CHECK(made.text.find("not_enough_movement: SP moves never by") != std::string::npos);
}

TEST_CASE("a clock time has a zone", "[records]") {
  CHECK(utc_ns_of("1970-01-01T00:00:01.5Z") == 1'500'000'000);
  CHECK(utc_ns_of("1970-01-01T01:00:01+01:00") == 1'000'000'000);
  for (const char* wrong : {"", "2026-11-26T10:00:00", "4h", "10:00Z", "2026-13-01T00:00:00Z"}) {
    INFO(wrong);
    CHECK_FALSE(utc_ns_of(wrong));
  }
}

TEST_CASE("the requested part of the recorded time is used", "[records][program]") {
  const RecordedLoop loop({0.0, 40.0});
  const std::string from = " --loop FIC-205 --since " + loop.at(100);
  const std::string out = " --out " + loop.path("out");
  REQUIRE(loop.loopwarden("gap" + from + " --until " + loop.at(900) + out).exit_code == 0);
  std::filesystem::path file;
  for (const auto& one : std::filesystem::directory_iterator(loop.path("out/records"))) {
    file = one.path();
  }
  const std::size_t rows = record::read_record(file).size();
  CHECK(rows >= 799);
  CHECK(rows <= 801);
  for (const std::string& wrong :
       {from + " --last 4h", " --loop FIC-205 --until " + loop.at(900), " --since " + loop.at(0),
        from + " --until tomorrow", from + " " + loop.path("r.csv")}) {
    INFO(wrong);
    CHECK(loop.loopwarden("gap" + wrong + out).exit_code == 64);
  }
}

TEST_CASE("in the background a command prints one sentence and its progress",
          "[records][program]") {
  const RecordedLoop loop({0.0, 40.0});
  const std::string page = loop.path("page.html");
  const ShellOutcome made =
      loop.loopwarden("diagnose --background --loop FIC-205 --last 4h --report " + page);
  INFO(made.text);
  CHECK(made.exit_code == 0);
  CHECK(made.text.find("progress: diagnose 100 %\n") != std::string::npos);
  CHECK(made.text.find("probability of a valve effect") != std::string::npos);
  CHECK(made.text.find("because: ") == std::string::npos);
  CHECK(std::filesystem::exists(page));
}

TEST_CASE("a survey reads a loop from the recorder under its own name", "[records][program]") {
  const RecordedLoop loop({0.0, 40.0});
  const ShellOutcome made = loop.of_recorder("survey --json");
  INFO(made.text);
  REQUIRE(made.exit_code == 0);
  CHECK(made.text.find("\"tag\": \"FIC-205\"") != std::string::npos);
  CHECK(loop.loopwarden("survey --loop FIC-205 --out " + loop.path("o") + " " + loop.path("r.csv"))
            .exit_code == 64);
}

}  // namespace loopwarden::workbench::recorder_input_test
