// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/lifecycle.hpp"

#include <csignal>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "base/clock.hpp"
#include "base/exit_code.hpp"
#include "base/signals.hpp"
#include "daemon/app/attempt.hpp"
#include "daemon/app/stop_actions.hpp"
#include "daemon/loops/event_text.hpp"
#include "daemon/registers/register_map.hpp"

namespace loopwarden::daemon {
namespace {

constexpr std::int64_t kSecond = base::kNanosecondsPerSecond;
constexpr std::int64_t kSupervisePeriod = kSecond / 10;  // ns between two rounds of the main thread

}  // namespace

App::App(config::Configuration configuration, const std::filesystem::path& config_path,
         const config::Specialists& specialists, std::function<std::uint64_t()> log_lines_lost)
    : parts_(std::move(configuration), config_path, specialists, std::move(log_lines_lost),
             service_) {}

App::~App() {
  parts_.loops.end();
  parts_.elsewhere.stop();
  if (parts_.modbus) parts_.modbus->gateway.stop();
  parts_.reloader.stop();
  parts_.control.stop();
  parts_.readers.stop();
  parts_.box_looker.stop();
  parts_.watching.monitor->stop();
  parts_.evidence.store().stop();
  parts_.evidence.explainer().stop();
  parts_.historian.stop();
  parts_.keeper->stop();
  parts_.journal.stop();
  for (LoopRuntime& loop : parts_.loops.all()) loop.device().close();
}

int App::run() {
  start();
  supervise();
  stop();
  end_threads();
  return ended_ ? kExitOk : kExitIo;
}

void App::start() {
  const config::DaemonConfig& config = parts_.configuration.daemon;
  for (LoopRuntime& loop : parts_.loops.all()) loop.device().open();
  parts_.reloader.start();
  parts_.journal.start();
  tell_out_of_service();
  parts_.evidence.start();
  parts_.historian.start();
  parts_.watching.monitor->start();
  parts_.box_looker.start();
  parts_.control.keep_metrics(std::filesystem::path(config.runtime_directory) / "metrics.prom");
  parts_.control.start();
  parts_.readers.start();
  parts_.loops.start(config.real_time);
  parts_.elsewhere.start();
  const std::string missing = parts_.loops.rights_missing();
  if (!missing.empty()) spdlog::warn("without real-time rights: {}", missing);
  wait_for_first_cycles();
  parts_.keeper->start();
  // The registers have values from here on.
  if (parts_.modbus) {
    const std::uint16_t port = parts_.modbus->gateway.port();
    if (port != 0) spdlog::info("Modbus server at port {}", port);
    parts_.modbus->gateway.start();
  }
  watch_threads();
  const std::size_t loops = parts_.loops.all().size();
  const auto watched = std::count_if(parts_.loops.all().begin(), parts_.loops.all().end(),
                                     [](const LoopRuntime& loop) { return loop.watched(); });
  const auto out = std::count_if(
      parts_.loops.all().begin(), parts_.loops.all().end(),
      [](const LoopRuntime& loop) { return config::out_of_service(loop.config.io) != nullptr; });
  spdlog::info("running {} loop{}{}{}", loops, loops == 1 ? "" : "s",
               watched > 0 ? fmt::format(", {} of them controlled elsewhere", watched) : "",
               out > 0 ? fmt::format(", {} of them out of service", out) : "");
  if (loops > registers::kMostLoops) {
    spdlog::warn("the register map has blocks for the first {} loops only", registers::kMostLoops);
  }
  service_.ready();
}

void App::tell_out_of_service() {
  for (const LoopRuntime& loop : parts_.loops.all()) {
    const std::string* why = config::out_of_service(loop.config.io);
    if (why == nullptr) continue;
    spdlog::error("loop {}: out of service until a restart with good files: {}", loop.config.name,
                  *why);
    journal::JournalEntry line;
    line.kind = journal::JournalEntry::Kind::system;
    line.utc_ms = base::utc_ms();
    line.loop = loop.config.name;
    line.what = "start";
    line.result = "out of service";
    line.reason = *why;
    parts_.journal.post(std::move(line));
  }
}

// Waits until every loop has run at least once. A loop that can't reach its devices reports a
// fault.
void App::wait_for_first_cycles() {
  base::Clock& clock = parts_.loops.clock();
  const std::int64_t deadline_ns = parts_.origin.started_ns + 30 * kSecond;
  record::RecordRow row;
  for (std::size_t i = 0; i < parts_.loops.all().size(); ++i) {
    while (!parts_.historian.latest(i, row) && clock.now_ns() < deadline_ns) {
      clock.sleep_until_ns(clock.now_ns() + kSecond / 100);
    }
  }
}

void App::watch_threads() {
  const std::int64_t now_ns = parts_.loops.clock().now_ns();
  const auto watch = [&](std::string name, std::function<std::uint64_t()> ticks,
                         std::int64_t patience_ns) {
    thread_watch_.add({std::move(name), std::move(ticks), patience_ns}, now_ns);
  };
  std::int64_t longest_period_ns = 0;
  for (const LoopRuntime& loop : parts_.loops.all()) {
    longest_period_ns =
        std::max(longest_period_ns, period_ns(loop.config, parts_.configuration.daemon.accelerate));
  }
  watch(
      "loops", [this] { return parts_.loops.ticks(); }, 2 * kSecond + 3 * longest_period_ns);
  watch(
      "historian", [this] { return parts_.historian.ticks(); }, 10 * kSecond);
  watch(
      "monitor", [this] { return parts_.watching.monitor->ticks(); }, 10 * kSecond);
  if (parts_.modbus) {
    watch(
        "gateway", [this] { return parts_.modbus->gateway.ticks(); }, 10 * kSecond);
  }
  watch(
      "control", [this] { return parts_.control.ticks(); }, 10 * kSecond);
  watch(
      "status", [this] { return parts_.readers.ticks(); }, 10 * kSecond);
  for (const LoopRuntime& loop : parts_.loops.all()) {
    const hal::Device* device = &loop.device();
    if (!device->has_thread()) continue;
    watch(
        "io of " + loop.config.name, [device] { return device->ticks(); }, 15 * kSecond);
  }
  if (const external::Sampler* sampler = parts_.elsewhere.sampler()) {
    watch(
        "watched loops", [sampler] { return sampler->ticks(); }, 10 * kSecond);
  }
  if (const external::FeedServer* feed = parts_.elsewhere.feed()) {
    watch(
        "feed", [feed] { return feed->ticks(); }, 10 * kSecond);
  }
}

void App::supervise() {
  for (;;) {
    const int signal = base::wait_for_signal({SIGTERM, SIGINT, SIGHUP},
                                             std::chrono::nanoseconds(kSupervisePeriod));
    if (signal == SIGTERM || signal == SIGINT) {
      spdlog::info("{}: outputs go to their stop actions",
                   signal == SIGTERM ? "SIGTERM" : "SIGINT");
      return;
    }
    attempt("reload refused", [&] {
      if (signal == SIGHUP) parts_.reloader.by_signal();
      parts_.reloader.step();
    });
    attempt("events", [this] { log_events(); });
    attempt("status", [this] { show_state(); });
    attempt("watchdog", [this] { feed_watchdog(); });
  }
}

void App::feed_watchdog() {
  const std::int64_t now_ns = parts_.loops.clock().now_ns();
  const std::vector<std::string> stuck = thread_watch_.stuck(now_ns);
  if (!stuck.empty() && !stuck_reported_) {
    spdlog::critical("no progress: {}; the watchdog is no longer fed", fmt::join(stuck, ", "));
  }
  stuck_reported_ = !stuck.empty();
  service_.keep_alive(stuck.empty(), now_ns);
}

void App::show_state() {
  const rt::RunnerStatus now = parts_.loops.publish_status();
  const std::size_t loops = parts_.loops.all().size();
  std::size_t faulty = 0;
  record::RecordRow row;
  for (std::size_t i = 0; i < loops; ++i) {
    if (parts_.historian.latest(i, row) && row.fault != control::Fault::none) ++faulty;
  }
  service_.status(
      fmt::format("{} loops, {} with a fault, {} overruns{}", loops, faulty, now.overruns,
                  parts_.loops.rights_missing().empty() ? "" : ", no real-time rights"));
}

void App::log_events() {
  // Limits the lines of a burst, so that it can't fill the disk. Further lines are counted.
  constexpr int kMostLinesPerLook = 50;
  rt::Event event;
  int lines = 0;
  std::uint64_t suppressed = 0;
  while (parts_.loops.next_event(event) || parts_.elsewhere.next_event(event)) {
    if (++lines > kMostLinesPerLook) {
      ++suppressed;
      continue;
    }
    const config::LoopConfig& loop = parts_.loops.all()[event.loop].config;
    // Loops out of service were reported at the start.
    if (config::out_of_service(loop.io) != nullptr) continue;
    if (event.code == rt::EventCode::cycle_missed) {
      missed_.warn("loop " + loop.name, "missed",
                   fmt::format("loop {}: {}", loop.name, describe(event, loop).text));
      continue;
    }
    if (is_first_end_of_fault(event)) continue;
    const EventText line = describe(event, loop);
    const auto level = line.severity == Severity::error     ? spdlog::level::err
                       : line.severity == Severity::warning ? spdlog::level::warn
                                                            : spdlog::level::info;
    spdlog::log(level, "loop {}: {}", loop.name, line.text);
  }
  if (suppressed > 0) spdlog::warn("{} more events not shown", suppressed);
  missed_.look();
  parts_.loops.backends().log().look();
}

// A healthy loop is `starting` until its first good PV. The end of that is no news.
bool App::is_first_end_of_fault(const rt::Event& event) {
  if (event.code != rt::EventCode::fault_changed) return false;
  const auto fault = static_cast<control::Fault>(event.a);
  had_fault_.resize(parts_.loops.all().size(), false);
  if (fault != control::Fault::none) {
    if (fault != control::Fault::starting) had_fault_[event.loop] = true;
    return false;
  }
  const bool had_fault = had_fault_[event.loop];
  had_fault_[event.loop] = false;
  return !had_fault;
}

void App::stop() {
  base::Clock& clock = parts_.loops.clock();
  service_.stopping();
  parts_.keeper->freeze();
  parts_.loops.stop();
  const std::int64_t deadline_ns =
      clock.now_ns() + std::llround(parts_.configuration.daemon.stop_timeout_s * 1e9);
  while (!parts_.loops.all_stopped() && clock.now_ns() < deadline_ns) {
    clock.sleep_until_ns(clock.now_ns() + kSecond / 100);
    attempt("events", [this] { log_events(); });
    attempt("watchdog", [this] { feed_watchdog(); });
  }
  parts_.loops.end();
  attempt("events", [this] { log_events(); });
  drive_to_stop(parts_.loops.all());
}

// Ends the threads. The outputs have had their stop actions. The remaining work is on the disk,
// which may hang for ever.
void App::end_threads() {
  constexpr std::int64_t kEndPatience = 5 * kSecond;
  constexpr std::chrono::milliseconds kLook{50};
  base::Clock& clock = parts_.loops.clock();
  parts_.elsewhere.stop();
  if (parts_.modbus) parts_.modbus->gateway.stop();
  parts_.watching.monitor->stop();
  const std::int64_t deadline_ns = clock.now_ns() + kEndPatience;
  std::vector<const char*> hung;
  const auto end = [&](const char* what, auto& part) {
    bool ended = part.stop_for(kLook);
    while (!ended && clock.now_ns() < deadline_ns) {
      attempt("watchdog", [&] { service_.keep_alive(true, clock.now_ns()); });
      ended = part.stop_for(kLook);
    }
    if (!ended) hung.push_back(what);
  };
  end("reload", parts_.reloader);
  end("control socket", parts_.control);
  end("status socket", parts_.readers);
  end("recorder", parts_.historian);
  end("last orders", *parts_.keeper);
  end("box", parts_.box_looker);
  end("evidence", parts_.evidence.store());
  end("explanations", parts_.evidence.explainer());
  end("journal", parts_.journal);  // last, because evidence writes lines to it
  ended_ = hung.empty();
  if (ended_) return;
  std::uint64_t rows = 0;
  for (std::size_t i = 0; i < parts_.loops.all().size(); ++i) {
    rows += parts_.historian.status(i).waiting;
  }
  spdlog::error(
      "the disk does not answer: {}; lost: {} waiting rows of recordings, {} lines of the "
      "journal, {} pieces of evidence",
      fmt::join(hung, ", "), rows, parts_.journal.status().waiting,
      parts_.evidence.store().status().waiting);
}

}  // namespace loopwarden::daemon
