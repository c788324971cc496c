// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <variant>
#include <vector>

#include <nlohmann/json.hpp>

#include "daemon/console/control_server.hpp"
#include "daemon/console/status_server.hpp"
#include "record/segment_format.hpp"
#include "record/segment_reader.hpp"
#include "tests/daemon/console/fake_daemon.hpp"
#include "tests/daemon/rt/loop_fixture.hpp"
#include "tests/support/temporary_folder.hpp"

namespace loopwarden::daemon::console_bench {

using nlohmann::json;

// The oldest sample of the record, if there is one; UTC.
inline constexpr std::int64_t kOldest_ms = 1'799'000'000'000;

// A loop, its historian and its control server, without a real-time thread. With `recorded`, an
// earlier run has left a record.
struct Console {
  explicit Console(const console::Rights& rights = {},
                   control::OutputAction start = control::OutputAction::go_to(40.0),
                   bool recorded = false)
      : historian(loops, {.state_directory = folder.path(), .sync = std::chrono::milliseconds(0)}) {
    LoopRuntime loop;
    loop.config.name = "FIC-101";
    loop.config.pv_unit = "L/min";
    loop.config.co_unit = "V";
    loop.config.controller = tests::plain_settings().controller;
    loop.config.controller.jacket.form = control::JacketForm::paper;
    loop.config.io = hal::modbus::LoopModbusSettings{};
    loop.config.recording.enabled = recorded;
    if (recorded) leave_segment(loop.config.name);
    const rt::LoopSettings settings = settings_of(loop.config, config::backing_of(loop.config.io));
    loop.channels = std::make_unique<rt::LoopChannels>(rt::LoopChannels::Room{});
    loop.commissioning = std::make_unique<Commissioning>(*loop.channels);
    loop.settings = std::make_unique<CurrentSettings>(settings, *loop.channels);
    auto io = std::make_unique<tests::FakeLoopIo>();
    io->set_pv(50.0);
    cycle = std::make_unique<rt::ControlCycle>(
        0, tests::kPeriod, settings, rt::StartSettings{control::Mode::automatic, 50.0, start},
        rt::ValvePositionSource::none, effects::EffectChain{}, *io, *loop.channels, events);
    loop.io = std::move(io);
    loops.push_back(std::move(loop));
    historian.start();
    journal.open();
    journal.start();
    server =
        std::make_unique<ControlServer>(folder.path(), plant(), archive(), daemon, daemon, rights);
    readers = std::make_unique<StatusServer>(folder.path(), plant(), archive(), daemon);
  }

  void leave_segment(const std::string& loop) const {
    const std::filesystem::path segments = historian.recorder().segments_folder(loop);
    std::filesystem::create_directories(segments);
    const record::EncodedHeader header = record::encode({.sequence = 1,
                                                         .run = 1,
                                                         .loop = loop,
                                                         .period_s = 0.1,
                                                         .start_utc_ns = kOldest_ms * 1'000'000,
                                                         .start_monotonic_ns = 0});
    std::ofstream(segments / record::segment_name(1), std::ios::binary)
        .write(header.bytes.data(), static_cast<std::streamsize>(header.bytes.size()));
  }
  console::Plant plant() { return tests::plant_of(*this); }
  console::Archive archive() { return tests::archive_of(*this); }
  json ask(const std::string& line, console::SocketName socket = console::SocketName::control) {
    const base::LocalServer::Answer answer = server->answer(line, socket, 1000);
    const auto* const later = std::get_if<base::LocalServer::Later>(&answer);
    if (later == nullptr) return json::parse(std::get<std::string>(answer));
    std::optional<std::string> told;
    while (!(told = (*later)())) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return json::parse(*told);
  }
  json ask_status(const std::string& line) { return json::parse(readers->answer(line)); }
  std::vector<rt::Command> commands() {
    std::vector<rt::Command> taken;
    rt::Command order;
    while (loops.front().channels->operator_commands.commands.try_pop(order))
      taken.push_back(order);
    return taken;
  }
  // Runs the loop's next cycles.
  void run(int cycles) {
    for (int i = 0; i < cycles; ++i) {
      ++cycles_run;
      cycle->run({.now_ns = static_cast<std::int64_t>(cycles_run) * tests::kPeriodNs,
                  .period_index = cycles_run},
                 0, false);
    }
  }
  // Returns the outcome of the command that got this answer.
  json outcome(const json& answer) {
    return ask(
        json{{"request", "order"}, {"loop", "FIC-101"}, {"order", answer.at("order")}}.dump());
  }
  void record(std::uint64_t period, double pv) {
    loops.front().channels->records.try_push({.period_index = period, .sp = 5.0, .pv = pv});
  }

  tests::TemporaryFolder folder;
  std::vector<LoopRuntime> loops;
  Historian historian;
  journal::Journal journal{{.folder = folder.path()}};
  EvidenceStore evidence{{.folder = folder / "evidence"}, {}, {}};
  std::int64_t now_ms = 1'800'000'000'000;
  reports::ReportQueue reports = tests::desk_in(folder.path(), [this] { return now_ms; });
  supervision::AlarmRegistry board{{{"FIC-101", 0.1}}, {}, journal, [this] { return now_ms; }};
  daemon::host::HostAlarms box_alarms{{}, journal, [this] { return now_ms; }};
  base::SpscRing<rt::Event> events{64};
  std::unique_ptr<rt::ControlCycle> cycle;
  std::uint64_t cycles_run = 0;
  tests::FakeDaemon daemon{folder.path(), [] { return protocol::DaemonStatus{.version = "test"}; }};
  std::unique_ptr<ControlServer> server;
  std::unique_ptr<StatusServer> readers;
};

inline alarm::AlarmConditions stiction_on() {
  alarm::AlarmConditions conditions{};
  conditions[0] = {true, 6.5};
  return conditions;
}

}  // namespace loopwarden::daemon::console_bench
