// SPDX-License-Identifier: Apache-2.0
// A hung disk: only the threads that are made for it wait, lost data is counted, and all parts
// continue when the disk answers again.
#include <fcntl.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <catch2/catch.hpp>
#include <nlohmann/json.hpp>
#include <filesystem>
#include <functional>
#include <future>
#include <memory>
#include <sstream>
#include <string>
#include <thread>

#include "daemon/host/host_probe.hpp"
#include "daemon/console/control_server.hpp"
#include "base/blocking/blocking_worker.hpp"
#include "daemon/app/log_queue.hpp"
#include "base/clock.hpp"
#include "base/local_socket.hpp"
#include "record/record_csv.hpp"
#include "tests/daemon/console/fake_daemon.hpp"
#include "tests/daemon/rt/loop_fixture.hpp"
#include "tests/support/device/foreign_process.hpp"
#include "tests/support/hung_disk.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::hung_disk_test {
namespace {

using nlohmann::json;
using std::chrono::milliseconds;
using test::eventually;

constexpr std::size_t kQueue = 64;  // rows: the smallest possible

// A recorded loop, with all its threads except the real-time one.
struct Bench {
  explicit Bench(const std::string& pipe = {})
      : historian(loops, RecorderSettings{.state_directory = folder.path(),
                                          .sync = milliseconds(0),
                                          .queue_bytes = 0}) {
    if (!pipe.empty()) REQUIRE(::mkfifo((folder / pipe).c_str(), 0600) == 0);
    LoopRuntime loop;
    loop.config.name = "FIC-101";
    loop.config.controller = tests::plain_settings().controller;
    loop.config.io = hal::modbus::LoopModbusSettings{};
    loop.io = std::make_unique<tests::FakeLoopIo>();
    loop.channels = std::make_unique<rt::LoopChannels>(
        rt::LoopChannels::Room{.records = 1024, .watched = 1024});
    loop.commissioning = std::make_unique<Commissioning>(*loop.channels);
    loop.settings = std::make_unique<CurrentSettings>(
        settings_of(loop.config, config::backing_of(loop.config.io)), *loop.channels);
    loops.push_back(std::move(loop));
    journal.open();
    journal.start();
    evidence.start();
    historian.start();
    server = std::make_unique<ControlServer>(folder.path(), tests::plant_of(*this),
                                             tests::archive_of(*this), daemon, daemon,
                                             console::Rights{});
    server->keep_metrics(folder / "metrics.prom");
    server->start();
  }

  protocol::DaemonStatus daemon_status() {
    const journal::JournalStatus lines = journal.status();
    protocol::DaemonStatus status;
    status.version = "test";
    status.recorder.disk_wait_s = historian.recorder().disk_wait_s();
    status.journal.lost = lines.lost;
    status.journal.waiting = lines.waiting;
    status.journal.error = lines.error;
    return status;
  }
  // Sends a request over the socket, as an operator does.
  json ask(const json& request) {
    base::LocalClient client((folder / "control.sock").string());
    return json::parse(client.request(request.dump(), std::chrono::seconds(60)));
  }
  json recording() { return ask({{"request", "status"}}).at("loops").at(0).at("recording"); }
  // Returns true once `count` more rows have been taken from the real-time thread and passed to the
  // recorder.
  bool take(std::uint64_t count) {
    for (std::uint64_t i = 0; i < count; ++i) {
      loops.front().channels->records.try_push({.period_index = next++, .pv = 5.0});
    }
    if (!eventually([&] { return historian.status(0).rows == next - 1; })) return false;
    const std::uint64_t round = historian.ticks();
    return eventually([&] { return historian.ticks() > round; });
  }
  // Returns true once every thread that the watchdog judges has moved three times.
  bool moves() {
    const std::uint64_t rounds = historian.ticks() + 3;
    const std::uint64_t served = server->ticks() + 3;
    return eventually([&] { return historian.ticks() >= rounds && server->ticks() >= served; });
  }

  tests::TemporaryFolder folder;
  std::vector<LoopRuntime> loops;
  Historian historian;
  journal::Journal journal{{.folder = folder.path(), .most_waiting = 8}};
  EvidenceStore evidence{
      {.folder = folder / "evidence"},
      {},
      [](const evidence::Evidence&, const std::filesystem::path&, const std::string&) {}};
  reports::ReportQueue reports = tests::desk_in(folder.path(), base::utc_ms);
  supervision::AlarmRegistry board{{{"FIC-101", 0.1}}, {}, journal, [] { return std::int64_t{1}; }};
  daemon::host::HostAlarms box_alarms{{}, journal, [] { return std::int64_t{1}; }};
  tests::FakeDaemon daemon{folder.path(), [this] { return daemon_status(); }};
  std::unique_ptr<ControlServer> server;
  std::uint64_t next = 1;
};

alarm::AlarmConditions stiction_on() {
  alarm::AlarmConditions conditions{};
  conditions[0] = {true, 6.5};
  return conditions;
}

TEST_CASE(
    "while the recorder's disk hangs, the watched threads move, the operator is answered, drops "
    "are counted, and recording continues afterwards",
    "[disk]") {
  Bench bench;
  REQUIRE(bench.take(5));
  REQUIRE(eventually([&] { return bench.historian.status(0).segments.rows >= 5; }));

  tests::HungDisk disk(bench.folder.path());
  REQUIRE(bench.take(1));
  REQUIRE(eventually([&] { return disk.waiting() > 0; }));
  CHECK(bench.moves());
  REQUIRE(bench.take(kQueue + 10));
  const json hung = bench.recording();
  CHECK(hung.at("waiting") == kQueue);
  CHECK(hung.at("queue_dropped").get<std::uint64_t>() >= 10);
  CHECK(hung.at("dropped") == 0);
  CHECK(bench.ask({{"request", "trend"}, {"loop", "FIC-101"}}).at("period").size() > kQueue);
  CHECK(eventually([&] { return bench.historian.recorder().disk_wait_s() > 0.1; }));
  CHECK(bench.moves());

  disk.release();
  REQUIRE(eventually([&] { return bench.historian.status(0).waiting == 0; }));
  REQUIRE(bench.take(5));
  // Every row is written or counted. Rows that have left the queue may still be on their way.
  CHECK(eventually([&] {
    const RecordingStatus after = bench.historian.status(0);
    return after.segments.rows + after.queue_dropped == after.rows;
  }));
  CHECK(bench.historian.status(0).segments.disk_errors == 0);
}

TEST_CASE("a CSV record on a hung disk: status and threads continue, its rows are written later",
          "[disk]") {
  Bench bench;
  const json started = bench.ask({{"request", "record"}, {"loop", "FIC-101"}, {"start", "trial"}});
  REQUIRE(started.at("ok") == true);
  REQUIRE(bench.take(5));

  tests::HungDisk disk(bench.folder.path());
  REQUIRE(bench.take(3));
  REQUIRE(eventually([&] { return disk.waiting() > 0; }));
  CHECK(bench.recording().at("csv_file") == started.at("file"));
  const json refused = bench.ask({{"request", "record"}, {"loop", "FIC-101"}, {"stop", true}});
  CHECK(refused.at("ok") == false);
  CHECK_THAT(refused.at("error").get<std::string>(),
             Catch::Contains("has not answered") && Catch::Contains("completed once it does"));
  CHECK(bench.moves());

  disk.release();
  REQUIRE(eventually([&] { return bench.recording().at("csv_file") == ""; }));
  CHECK(bench.recording().at("csv_error") == "");
  CHECK(record::read_record(started.at("file").get<std::string>()).size() == 8);
}

TEST_CASE("a CSV record that could not begin in time is not begun later without the operator",
          "[disk]") {
  Bench bench;
  tests::HungDisk disk(bench.folder.path());
  const json order{{"request", "record"}, {"loop", "FIC-101"}, {"start", "late"}};
  const json refused = bench.ask(order);
  CHECK(refused.at("ok") == false);
  CHECK_THAT(refused.at("error").get<std::string>(), Catch::Contains("no record was begun"));
  CHECK(bench.recording().at("csv_file") == "");
  CHECK(bench.ask(order).at("ok") == false);
  disk.release();
  REQUIRE(eventually([&] { return bench.ask(order).at("ok") == true; }));
  REQUIRE(bench.take(4));
  CHECK(bench.ask({{"request", "record"}, {"loop", "FIC-101"}, {"stop", true}}).at("ok") == true);
  CHECK(record::read_record(bench.folder.path() / "records" / "late.csv").size() == 4);
}

TEST_CASE(
    "while the journal's disk hangs: its lines wait in bounded memory, alarms are handled and "
    "remembered, and the status reports the fault",
    "[disk]") {
  Bench bench;
  bench.board.of(0).window_judged({}, {}, stiction_on());
  REQUIRE(eventually([&] { return bench.journal.status().waiting == 0; }));

  tests::HungDisk disk(bench.folder.path());
  bench.journal.post({});
  REQUIRE(eventually([&] { return disk.waiting() > 0; }));
  const json order{{"request", "alarm"},
                   {"loop", "FIC-101"},
                   {"alarm", "stiction"},
                   {"action", "shelve"},
                   {"minutes", 30}};
  const json done = bench.ask(order);
  CHECK(done.at("ok") == true);
  CHECK(done.at("on_disk") == false);
  for (int i = 0; i < 30; ++i) {
    journal::JournalEntry line;
    line.what = "line " + std::to_string(i);
    bench.journal.post(std::move(line));
  }
  REQUIRE(eventually([&] { return !bench.journal.status().error.empty(); }));
  const journal::JournalStatus hung = bench.journal.status();
  CHECK_THAT(hung.error, Catch::Contains("has not answered"));
  CHECK(hung.waiting <= 16);
  CHECK(hung.lost > 0);
  CHECK(bench.moves());
  const json lines = bench.ask({{"request", "journal"}});
  CHECK(lines.at("ok") == false);
  CHECK_THAT(lines.at("error").get<std::string>(), Catch::Contains("disk does not answer"));
  const json told = bench.ask({{"request", "explain"}, {"loop", "FIC-101"}, {"alarm", "stiction"}});
  CHECK(told.at("disk_answers") == false);
  CHECK_FALSE(told.at("action").get<std::string>().empty());
  CHECK(bench.ask({{"request", "alarms"}}).at("ok") == true);

  disk.release();
  REQUIRE(eventually([&] { return bench.journal.status().error.empty(); }));
  REQUIRE(eventually([&] { return bench.journal.status().waiting == 0; }));
  CHECK(eventually([&] { return bench.ask({{"request", "journal"}}).at("ok") == true; }));
  bench.journal.stop();
  const journal::AlarmStates states = journal::Journal({.folder = bench.folder.path()}).open();
  const auto memory = states.memories.find({"FIC-101", "stiction"});
  REQUIRE(memory != states.memories.end());
  CHECK(memory->second.shelved_until_ms > 0);  // its line was among those without room
}

TEST_CASE("while a disk hangs, every thread can be asked to end, and no wait is long", "[disk]") {
  Bench bench;
  tests::HungDisk disk(bench.folder.path());
  REQUIRE(bench.take(1));
  REQUIRE(eventually([&] { return disk.waiting() > 0; }));
  bench.ask({{"request", "journal"}});
  CHECK_FALSE(bench.historian.stop_for(milliseconds(20)));
  CHECK_FALSE(bench.server->stop_for(milliseconds(20)));
  bench.journal.post({});
  CHECK_FALSE(bench.journal.stop_for(milliseconds(20)));
  disk.release();
  CHECK(bench.historian.stop_for(milliseconds(60'000)));
  CHECK(bench.server->stop_for(milliseconds(60'000)));
  CHECK(bench.journal.stop_for(milliseconds(60'000)));
  CHECK(bench.historian.status(0).segments.rows == 1);
}

TEST_CASE("while the metrics' disk hangs the operator is answered and no part stops", "[disk]") {
  // Opening a pipe without a reader blocks as a hung disk does.
  const std::string pipe_name = "metrics.prom.tmp";
  Bench bench(pipe_name);
  CHECK(bench.moves());
  CHECK(bench.ask({{"request", "status"}}).at("ok") == true);
  CHECK_FALSE(bench.server->stop_for(milliseconds(20)));
  const int reader = ::open((bench.folder / pipe_name).c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
  CHECK(bench.server->stop_for(milliseconds(60'000)));
  ::close(reader);
}

TEST_CASE("an errand: no other job waits for one that hangs, and its result may be too late",
          "[disk]") {
  std::atomic<bool> hangs{true};
  loopwarden::base::BlockingWorker task("lw-test");
  const std::function<int()> slow = [&hangs] {
    while (hangs) std::this_thread::sleep_for(milliseconds(1));
    return 1;
  };
  CHECK_FALSE(task.ask<int>(slow, milliseconds(20)).has_value());
  CHECK_FALSE(task.begin([] {}));
  REQUIRE(eventually([&] { return task.seconds() > base::DiskWait::kHung; }));
  // If it waited, this would last for ever.
  CHECK_FALSE(task.ask<int>([] { return 2; }, std::chrono::hours(1)).has_value());
  hangs = false;
  CHECK(eventually([&] { return task.ask<int>([] { return 3; }, milliseconds(1000)) == 3; }));
  CHECK_THROWS_WITH(task.ask<int>([]() -> int { throw std::runtime_error("no such file"); },
                                  std::chrono::seconds(10)),
                    "no such file");
  CHECK(task.stop_for(milliseconds(60'000)));
}

TEST_CASE(
    "the log: a writer never waits for the reader, lost lines are counted, waiting ones stay in "
    "order",
    "[disk]") {
  std::array<int, 2> pipe{};
  REQUIRE(::pipe2(pipe.data(), O_CLOEXEC) == 0);
  REQUIRE(::fcntl(pipe[1], F_SETPIPE_SZ, 4096) > 0);
  const auto queue = std::make_shared<LogQueue>(pipe[1], 100);
  spdlog::logger log("test", queue);
  log.set_pattern("%v");
  const std::string line(200, 'x');
  for (int i = 0; i < 1000; ++i) log.info("{} {}", i, line);  // without a reader
  CHECK(queue->lost() > 0);
  CHECK_FALSE(queue->stop_for(milliseconds(20)));

  std::string text;
  while (!queue->stop_for(milliseconds(1))) {
    std::array<char, 4096> some{};
    pollfd ready{pipe[0], POLLIN, 0};
    if (::poll(&ready, 1, 0) <= 0) continue;
    const ssize_t n = ::read(pipe[0], some.data(), some.size());
    if (n > 0) text.append(some.data(), static_cast<std::size_t>(n));
  }
  ::close(pipe[1]);
  std::array<char, 65536> rest{};
  for (ssize_t n = 0; (n = ::read(pipe[0], rest.data(), rest.size())) > 0;) {
    text.append(rest.data(), static_cast<std::size_t>(n));
  }
  ::close(pipe[0]);
  CHECK(text.starts_with("0 x"));
  CHECK(text.find("\n1 x") < text.find("\n2 x"));
  // One notice, or several if the pipe took a line in between. Together they count every lost line.
  std::uint64_t said = 0;
  std::istringstream lines(text);
  for (std::string one; std::getline(lines, one);) {
    if (one.find(" lines of the log were lost") != std::string::npos) said += std::stoull(one);
  }
  CHECK(said == queue->lost());
}

TEST_CASE(
    "while the host's check of the disk hangs, other host alarms are raised, and one for the disk",
    "[disk][box]") {
  using alarm::BoxAlarm;
  Bench bench;
  std::promise<void> answers;
  std::atomic<double> wait_s{0.0};
  std::atomic<std::uint64_t> dropped{0};
  host::HostProbe looker({.disk =
                              [until = answers.get_future().share()] {
                                until.wait();
                                return host::DiskLook{.room_bytes = 1'000'000'000};
                              },
                          .status =
                              [&] {
                                protocol::DaemonStatus status;
                                status.recorder.disk_wait_s = wait_s;
                                return status;
                              },
                          .lost_connections = [](double) { return host::LostConnections{}; },
                          .dropped = [&] { return dropped++; },
                          .failed_parts = [] { return std::vector<std::string>{}; },
                          .period = milliseconds(20)},
                         bench.box_alarms);
  const auto on = [&](BoxAlarm kind) { return bench.box_alarms.alarms().alarm(kind).active(); };
  looker.start();
  CHECK(eventually([&] { return on(BoxAlarm::records_dropped); }));
  CHECK_FALSE(on(BoxAlarm::disk_full));
  wait_s = 12.0;  // the recorder's wait, for the same disk
  CHECK(eventually([&] { return on(BoxAlarm::disk_full); }));
  CHECK(bench.box_alarms.why(BoxAlarm::disk_full) == "the disk has not answered for 12 s");
  CHECK_FALSE(looker.stop_for(milliseconds(20)));
  answers.set_value();
  CHECK(looker.stop_for(std::chrono::seconds(10)));
}

TEST_CASE("rows that recorder and monitor were too slow for count as dropped", "[disk][box]") {
  Bench bench;
  rt::LoopChannels& channels = *bench.loops.front().channels;
  for (std::size_t i = 0; i < channels.watched.capacity() + 3; ++i) channels.watched.try_push({});
  CHECK(bench.historian.dropped() == 3);  // no thread empties the monitor's ring here
  const tests::HungDisk disk(bench.folder.path());
  REQUIRE(bench.take(1));
  REQUIRE(eventually([&] { return disk.waiting() > 0; }));
  REQUIRE(bench.take(kQueue + 10));
  CHECK(bench.historian.dropped() == 3 + bench.historian.status(0).queue_dropped);
  CHECK(bench.historian.status(0).queue_dropped >= 10);
}

}  // namespace
}  // namespace loopwarden::daemon::hung_disk_test
