// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/app.hpp"

#include <csignal>
#include <ctime>
#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <numeric>
#include <stdexcept>
#include <system_error>
#include <thread>
#include <utility>

#include "config/loop_model_writer.hpp"
#include "daemon/explain/explanation_file.hpp"
#include "daemon/explain/pending_explanation.hpp"
#include "daemon/loops/event_text.hpp"
#include "daemon/loops/loop_health.hpp"
#include "daemon/loops/loop_orders.hpp"
#include "base/exit_code.hpp"
#include "base/real_time.hpp"
#include "base/signals.hpp"
#include "model/commission/explain.hpp"
#include "model/monitor/specialist_judge.hpp"
#include "model/effects/catalogue.hpp"

namespace loopwarden::daemon {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;          // ns
constexpr std::int64_t kSupervisePeriod = kSecond / 10;  // ns between two looks of the main thread
constexpr double kRingSeconds = 15.0;                    // that the historian may be late

std::int64_t period_ns(const config::LoopConfig& loop, double accelerate) {
  return std::llround(loop.sample_time_s / accelerate * 1e9);
}

plant::EffectChain valve_model_of(const config::LoopConfig& loop) {
  plant::EffectChain chain;
  effects::EffectContext context{.sample_time_s = loop.sample_time_s,
                                 .output_low = loop.controller.pid.output_low,
                                 .output_high = loop.controller.pid.output_high,
                                 .seed = 1};
  for (const plant::EffectSpec& spec : loop.valve_position.model) {
    chain.add(effects::make_effect(spec, context));
  }
  return chain;
}

rt::ValvePositionSource source_of(const config::ValvePosition& position) {
  switch (position.source) {
    case config::ValvePosition::Source::read_back: return rt::ValvePositionSource::read_back;
    case config::ValvePosition::Source::model: return rt::ValvePositionSource::model;
    case config::ValvePosition::Source::none: break;
  }
  return rt::ValvePositionSource::none;
}

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * kSecond + now.tv_nsec;
}

std::int64_t utc_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::vector<monitor::WatchBoard::Loop> watched_loops(const config::Configuration& configuration) {
  std::vector<monitor::WatchBoard::Loop> loops;
  for (const config::LoopConfig& loop : configuration.loops) {
    loops.push_back({loop.name, loop.sample_time_s});
  }
  return loops;
}

std::map<std::string, config::SpecialistFolder> contents_of(const Specialists& specialists) {
  std::map<std::string, config::SpecialistFolder> contents;
  for (const auto& [name, folder] : specialists.folders) contents.emplace(name, folder.content);
  return contents;
}

console::Rights rights_of(const config::DaemonConfig& config) {
  return {.page = config.page, .edge = config.edge};
}

// Where the sockets lie; made where it is missing.
std::filesystem::path socket_folder(const std::string& runtime_directory) {
  std::error_code error;
  std::filesystem::create_directories(runtime_directory, error);
  if (error) {
    throw std::runtime_error(
        fmt::format("runtime_directory {}: {}", runtime_directory, error.message()));
  }
  return runtime_directory;
}

gateway::MasterLossAction action_of(config::ModbusServer::LossAction action) {
  switch (action) {
    case config::ModbusServer::LossAction::manual: return gateway::MasterLossAction::manual;
    case config::ModbusServer::LossAction::automatic: return gateway::MasterLossAction::automatic;
    case config::ModbusServer::LossAction::report: break;
  }
  return gateway::MasterLossAction::report;
}

std::optional<gateway::SerialServerSettings> serial_of(const config::ModbusServer& server) {
  if (!server.serial) return std::nullopt;
  return gateway::SerialServerSettings{
      .line = server.serial->line, .unit = server.serial->unit, .writes = server.serial->writes};
}

// What goes wrong beside the loops, such as memory that can't be had, must not end them. False if it
// did.
template <class Step>
bool attempt(const char* what, Step step) {
  try {
    step();
    return true;
  } catch (const std::exception& e) {
    spdlog::error("{}: {}; the loops run on", what, e.what());
    return false;
  }
}

// Runs `step(i)` for all of `count` at once: a device that is dead must not let the others wait.
template <class Step>
void for_all_at_once(std::size_t count, Step step) {
  std::vector<std::thread> threads;
  threads.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    try {
      threads.emplace_back(step, i);
    } catch (const std::system_error&) {
      step(i);  // no more threads: then one after the other
    }
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace

App::App(config::Configuration configuration, std::filesystem::path config_path,
         const Specialists& specialists, std::function<std::uint64_t()> log_lines_lost)
    : configuration_(std::move(configuration)),
      config_path_(std::move(config_path)),
      started_ns_(clock_.now_ns()),
      started_ms_(utc_ms()),
      historian_(loops_, configuration_.daemon.state_directory),
      journal_({.folder = configuration_.daemon.state_directory}),
      board_(watched_loops(configuration_), configuration_.daemon.alarms.settings, journal_,
             utc_ms),
      model_hash_(specialists.hash),
      evidence_(
          {.folder = std::filesystem::path(configuration_.daemon.state_directory) / "evidence",
           .most_kept = configuration_.daemon.alarms.most_evidence},
          contents_of(specialists),
          [this](const evidence::Evidence& e, const std::filesystem::path& folder,
                 const std::string& why) { report_evidence(e, folder, why); },
          [this](const std::string& why) { report_evidence_stays(why); }),
      explainer_(
          {.program = workbench_program(),
           .save = std::chrono::milliseconds(
               std::llround(60'000.0 / configuration_.daemon.accelerate))},
          [this](std::size_t loop) { return monitor_->history(loop)->minutes(); },
          [this](const ExplainJob& job, const Explanation* explanation, const std::string& why) {
            report_explanation(job, explanation, why);
          }),
      reloader_(configuration_, config_path_, loops_, historian_, journal_, reloader_ends()),
      control_(socket_folder(configuration_.daemon.runtime_directory), console_parts(),
               rights_of(configuration_.daemon)),
      readers_(configuration_.daemon.runtime_directory, console_parts()),
      log_lines_lost_(std::move(log_lines_lost)),
      rights_missing_(configuration_.daemon.real_time.lock_memory ? base::lock_memory() : "") {
  const double accelerate = configuration_.daemon.accelerate;
  std::int64_t tick_ns = 0;
  for (const config::LoopConfig& loop : configuration_.loops) {
    tick_ns = std::gcd(tick_ns, period_ns(loop, accelerate));
  }
  runner_ = std::make_unique<rt::CyclicRunner>(clock_, tick_ns);

  loops_.reserve(configuration_.loops.size());
  for (const config::LoopConfig& config : configuration_.loops) {
    LoopRuntime loop;
    loop.config = config;
    const rt::LoopSettings settings = settings_of(config, config::backing_of(config.io));
    loop.io = backends_.make(config);
    loop.channels = std::make_unique<rt::LoopChannels>(
        static_cast<std::size_t>(kRingSeconds / config.sample_time_s * accelerate) + 64);
    loop.settings = std::make_unique<CurrentSettings>(settings, *loop.channels);
    loop.cycle = std::make_unique<rt::ControlCycle>(
        static_cast<std::uint32_t>(loops_.size()), config.sample_time_s, settings,
        rt::StartSettings{config.start.mode, config.start.set_point, config.start.output},
        source_of(config.valve_position), valve_model_of(config), *loop.io, *loop.channels,
        events_);
    loops_.push_back(std::move(loop));
    runner_->add(*loops_.back().cycle,
                 static_cast<std::uint64_t>(period_ns(config, accelerate) / tick_ns));
  }

  board_.restore(journal_.open());
  for (const auto& [name, folder] : specialists.folders) {
    judges_[name] = std::make_unique<loopwarden::monitor::SpecialistJudge>(*folder.content.team);
    specialist_hashes_[name] = folder.hash;
  }
  std::vector<monitor::WatchedLoop> watched;
  for (const auto& [name, twin] : specialists.twins) {
    twins_[name] = config::write_model(twin, name);
  }
  for (LoopRuntime& loop : loops_) {
    // One judge serves all loops of its folder: there is one monitor thread.
    const auto judge = judges_.find(loop.config.monitor.specialists);
    const auto twin = specialists.twins.find(loop.config.monitor.twin);
    watched.push_back({.cycles = &loop.channels->watched,
                       .window = window_of(loop.config),
                       .judge = judge == judges_.end() ? nullptr : judge->second.get(),
                       .twin = twin == specialists.twins.end() ? nullptr : &twin->second,
                       .history_s = commission::kLongest_s + commission::kEnough_s,
                       .rule = loopwarden::monitor::kAlarmRule,
                       .normal_mode = loop.config.normal_mode,
                       .corrective = loop.config.monitor.corrective,
                       .orders = &monitor_desks_.emplace_back(
                           desk_of(loop, loop.channels->monitor_orders, journal_)),
                       .settings_taken = &loop.channels->settings_taken});
  }
  monitor_ = std::make_unique<monitor::Monitor>(
      watched, board_,
      [this](std::size_t loop, loopwarden::monitor::AlarmKind alarm,
             const loopwarden::monitor::LoopMonitor& loop_monitor,
             const loopwarden::monitor::MonitorStep& step,
             loopwarden::monitor::AlarmReason reason) {
        keep_evidence(loop, alarm, loop_monitor, step, reason);
      });
  remember_explanations();
  if (configuration_.daemon.modbus_server) make_gateway();
}

void App::make_gateway() {
  const config::ModbusServer& server = *configuration_.daemon.modbus_server;
  plant_ = std::make_unique<GatewayLoops>(console_parts());
  gateway_ = std::make_unique<gateway::Gateway>(
      gateway::GatewaySettings{.tcp = {.address = server.address,
                                       .port = server.port,
                                       .unit = server.unit,
                                       .most_clients = server.most_clients,
                                       .idle_timeout_s = server.idle_timeout_s,
                                       .requests_per_second = server.requests_per_second,
                                       .listener = health::modbus_listener()},
                               .peers = server.clients,
                               .writes = server.writes,
                               .word_order = server.word_order,
                               .master_heartbeat = {.timeout_s = server.master_timeout_s,
                                                    .action = action_of(server.on_master_loss)},
                               .serial = serial_of(server)},
      *plant_, clock_);
}

void App::keep_evidence(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                        const loopwarden::monitor::LoopMonitor& loop_monitor,
                        const loopwarden::monitor::MonitorStep& step,
                        loopwarden::monitor::AlarmReason reason) {
  const config::LoopConfig& config = loops_[loop].config;
  evidence::Evidence evidence;
  evidence.loop = config.name;
  evidence.alarm = alarm;
  evidence.raised_ms = board_.watch(loop).alarms.alarm(alarm).memory().raised_ms;
  if (reason == loopwarden::monitor::AlarmReason::twin) {
    monitor::History::Minutes minutes = monitor_->history(loop)->minutes();
    evidence.take(loop_monitor, std::move(minutes.sp), std::move(minutes.pv),
                  std::move(minutes.co));
  } else {
    evidence.take(loop_monitor, step, reason);
  }
  evidence.version = LOOPWARDEN_VERSION;
  evidence.config_hash = reloader_.config_hash();
  evidence.loop_file = config.file;
  if (const monitor::History* history = monitor_->history(loop)) {
    evidence.raised_at = history->newest();
    evidence.twin = twins_.at(config.monitor.twin);
  }
  if (evidence.by_specialists()) {
    evidence.specialists_folder = config.monitor.specialists;
    evidence.specialists_hash = specialist_hashes_[config.monitor.specialists];
  }
  evidence_.post(std::move(evidence));
}

void App::report_evidence(const evidence::Evidence& evidence, const std::filesystem::path& folder,
                          const std::string& why) {
  journal::JournalEntry entry;
  entry.kind = journal::JournalEntry::Kind::system;
  entry.utc_ms = utc_ms();
  entry.loop = evidence.loop;
  entry.alarm = loopwarden::monitor::to_text(evidence.alarm);
  entry.what = "evidence";
  entry.new_value = folder.string();
  entry.result = why.empty() ? "done" : "not written: " + why;
  journal_.post(std::move(entry));
  if (why.empty() && !evidence.twin.empty()) have_explained(evidence, folder);
}

void App::report_evidence_stays(const std::string& why) {
  journal::JournalEntry entry;
  entry.kind = journal::JournalEntry::Kind::system;
  entry.utc_ms = utc_ms();
  entry.what = "evidence";
  entry.result = "old evidence is not removed: " + why;
  journal_.post(std::move(entry));
}

void App::have_explained(const evidence::Evidence& evidence, const std::filesystem::path& folder) {
  const auto loop = std::find_if(loops_.begin(), loops_.end(), [&](const LoopRuntime& l) {
    return l.config.name == evidence.loop;
  });
  const auto index = static_cast<std::size_t>(loop - loops_.begin());
  const monitor::History& history = *monitor_->history(index);
  // What came before the alarm may be too little to tell: then the minutes behind it are waited for.
  const double unquiet_s = history.unquiet_s();
  const double wait_s = unquiet_s > 0.0 ? std::max(0.0, commission::kEnough_s - unquiet_s) : 0.0;
  const double since_s =
      static_cast<double>(history.newest() - evidence.raised_at) * loop->config.sample_time_s;
  explainer_.post({.loop = index,
                   .alarm = evidence.alarm,
                   .raised_at = evidence.raised_at,
                   .raised_ms = evidence.raised_ms,
                   .folder = folder,
                   .wait = std::chrono::milliseconds(
                       std::llround(1000.0 * wait_s / configuration_.daemon.accelerate)),
                   .enough_s = since_s + wait_s});
}

void App::report_explanation(const ExplainJob& job, const Explanation* explanation,
                             const std::string& why) {
  if (explanation != nullptr) {
    board_.explained(job.loop, *explanation);
    return;
  }
  Explanation none;
  none.alarm = job.alarm;
  none.raised_ms = job.raised_ms;
  none.ended_ms = utc_ms();
  none.verdict = kNotExplained;
  none.sentence = "Not explained: " + why + ".";
  none.folder = job.folder;
  attempt("explanation", [&] { write_not_explained(none); });
  board_.explained(job.loop, none);
}

// Of alarms that were on before the start, the newest last.
void App::remember_explanations() {
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    std::vector<Explanation> known;
    for (const loopwarden::monitor::AlarmKind kind : loopwarden::monitor::kValveAlarms) {
      if (!board_.watch(i).alarms.alarm(kind).active()) continue;
      const auto folder = evidence_.newest(board_.name(i), kind);
      if (!folder) continue;
      if (std::filesystem::exists(*folder / "explanation.json")) {
        attempt("explanation", [&] { known.push_back(read_explanation(*folder)); });
      } else if (monitor_->history(i) != nullptr) {
        resume_explanation(i, kind, *folder);
      }
    }
    std::sort(known.begin(), known.end(),
              [](const auto& a, const auto& b) { return a.ended_ms < b.ended_ms; });
    for (const Explanation& explanation : known) board_.restore(i, explanation);
  }
}

// Of an alarm that the daemon did not come to explain before it ended. Where no minutes were saved, the samples of its
// evidence are what there is.
void App::resume_explanation(std::size_t loop, loopwarden::monitor::AlarmKind alarm,
                             const std::filesystem::path& folder) {
  if (!std::filesystem::exists(folder / "twin.yaml")) return;
  const PendingExplanation pending =
      read_pending(folder).value_or(PendingExplanation{.enough_s = commission::kEnough_s});
  spdlog::info("loop {}: alarm {} is explained now: the restart came before", board_.name(loop),
               loopwarden::monitor::to_text(alarm));
  explainer_.post({.loop = loop,
                   .alarm = alarm,
                   .raised_ms = board_.watch(loop).alarms.alarm(alarm).memory().raised_ms,
                   .folder = folder,
                   .enough_s = pending.enough_s,
                   .resumed_s = pending.there_s,
                   .again = std::chrono::milliseconds(std::llround(
                       1000.0 * commission::kEnough_s / configuration_.daemon.accelerate))});
}

App::~App() {
  quit_ = true;
  real_time_thread_.join();
  if (gateway_) gateway_->stop();
  reloader_.stop();
  control_.stop();
  readers_.stop();
  monitor_->stop();
  evidence_.stop();
  explainer_.stop();
  historian_.stop();
  journal_.stop();
  for (LoopRuntime& loop : loops_) loop.io->close();
}

int App::run() {
  start();
  supervise();
  stop();
  end_threads();
  return ended_ ? kExitOk : kExitIo;
}

void App::start() {
  for (LoopRuntime& loop : loops_) loop.io->open();
  reloader_.start();
  journal_.start();
  evidence_.start();
  explainer_.start();
  historian_.start();
  monitor_->start();
  control_.keep_metrics(std::filesystem::path(configuration_.daemon.runtime_directory) /
                        "metrics.prom");
  control_.start();
  readers_.start();

  const config::RealTime& rights = configuration_.daemon.real_time;
  const std::string refused = real_time_thread_.start(
      {.name = "lw-loops", .fifo_priority = rights.priority, .cpu = rights.cpu}, [this] {
        base::prefault_stack();
        runner_->run(stop_, quit_);
      });
  if (!refused.empty()) {
    const std::lock_guard lock(status_mutex_);
    rights_missing_ += (rights_missing_.empty() ? "" : "; ") + refused +
                       ": a busy machine may delay the loops; raise LimitRTPRIO";
  }
  const std::string missing = rights_missing();
  if (!missing.empty()) spdlog::warn("without real-time rights: {}", missing);

  // Ready means: every loop has run at least once. Whether it found its devices shows in its fault.
  record::RecordRow row;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    while (!historian_.latest(i, row) && clock_.now_ns() - started_ns_ < 30 * kSecond) {
      clock_.sleep_until_ns(clock_.now_ns() + kSecond / 100);
    }
  }
  // Only now are there values to be read.
  if (gateway_) {
    gateway_->start();
    spdlog::info("Modbus server at port {}", gateway_->port());
  }
  watch_threads();
  spdlog::info("running {} loop{}", loops_.size(), loops_.size() == 1 ? "" : "s");
  service_.ready();
}

void App::watch_threads() {
  const std::int64_t now_ns = clock_.now_ns();
  std::int64_t longest_period_ns = 0;
  for (const LoopRuntime& loop : loops_) {
    longest_period_ns =
        std::max(longest_period_ns, period_ns(loop.config, configuration_.daemon.accelerate));
  }
  thread_watch_.add(
      {"loops", [this] { return runner_->ticks(); }, 2 * kSecond + 3 * longest_period_ns}, now_ns);
  thread_watch_.add({"historian", [this] { return historian_.ticks(); }, 10 * kSecond}, now_ns);
  thread_watch_.add({"monitor", [this] { return monitor_->ticks(); }, 10 * kSecond}, now_ns);
  if (gateway_) {
    thread_watch_.add({"gateway", [this] { return gateway_->ticks(); }, 10 * kSecond}, now_ns);
  }
  thread_watch_.add({"control", [this] { return control_.ticks(); }, 10 * kSecond}, now_ns);
  thread_watch_.add({"status", [this] { return readers_.ticks(); }, 10 * kSecond}, now_ns);
  for (const LoopRuntime& loop : loops_) {
    if (!loop.io->has_thread()) continue;
    const hal::LoopIo* io = loop.io.get();
    thread_watch_.add({"io of " + loop.config.name, [io] { return io->ticks(); }, 15 * kSecond},
                      now_ns);
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
      if (signal == SIGHUP) reloader_.by_signal();
      reloader_.step();
    });
    attempt("events", [this] { log_events(); });
    attempt("status", [this] { publish_runner_status(); });
    attempt("watchdog", [this] { feed_watchdog(); });
  }
}

void App::feed_watchdog() {
  const std::int64_t now_ns = clock_.now_ns();
  const std::vector<std::string> stuck = thread_watch_.stuck(now_ns);
  if (!stuck.empty() && !stuck_reported_) {
    spdlog::critical("no progress: {}; the watchdog is no longer fed", fmt::join(stuck, ", "));
  }
  stuck_reported_ = !stuck.empty();
  service_.keep_alive(stuck.empty(), now_ns);
}

void App::publish_runner_status() {
  const rt::RunnerStatus now = runner_->status();
  {
    const std::lock_guard lock(status_mutex_);
    runner_status_ = now;
  }
  std::size_t faulty = 0;
  record::RecordRow row;
  for (std::size_t i = 0; i < loops_.size(); ++i) {
    if (historian_.latest(i, row) && static_cast<control::Fault>(row.fault) != control::Fault::none)
      ++faulty;
  }
  service_.status(fmt::format("{} loops, {} with a fault, {} overruns{}", loops_.size(), faulty,
                              now.overruns,
                              rights_missing().empty() ? "" : ", no real-time rights"));
}

void App::log_events() {
  // One burst must not fill the disk: what is beyond the limit is counted.
  constexpr int kMostLinesPerLook = 50;
  rt::Event event;
  int lines = 0;
  std::uint64_t suppressed = 0;
  while (events_.try_pop(event)) {
    if (++lines > kMostLinesPerLook) {
      ++suppressed;
      continue;
    }
    const config::LoopConfig& loop = loops_[event.loop].config;
    const health::EventText line = health::describe(event, loop);
    const auto level = line.severity == health::Severity::error     ? spdlog::level::err
                       : line.severity == health::Severity::warning ? spdlog::level::warn
                                                                    : spdlog::level::info;
    spdlog::log(level, "loop {}: {}", loop.name, line.text);
  }
  if (suppressed > 0) spdlog::warn("{} more events not shown", suppressed);
}

// Outputs have had their stop action. What is left is the disk, and a disk may hang for ever.
void App::end_threads() {
  constexpr std::int64_t kEndPatience = 5 * kSecond;
  constexpr std::chrono::milliseconds kLook{50};
  if (gateway_) gateway_->stop();
  monitor_->stop();
  const std::int64_t deadline_ns = clock_.now_ns() + kEndPatience;
  std::vector<const char*> hung;
  const auto end = [&](const char* what, auto& part) {
    bool ended = part.stop_for(kLook);
    while (!ended && clock_.now_ns() < deadline_ns) {
      attempt("watchdog", [this] { service_.keep_alive(true, clock_.now_ns()); });
      ended = part.stop_for(kLook);
    }
    if (!ended) hung.push_back(what);
  };
  end("reload", reloader_);
  end("control socket", control_);
  end("status socket", readers_);
  end("recorder", historian_);
  end("evidence", evidence_);
  end("explanations", explainer_);
  end("journal", journal_);  // the last: evidence has a line for it
  ended_ = hung.empty();
  if (ended_) return;
  std::uint64_t rows = 0;
  for (std::size_t i = 0; i < loops_.size(); ++i) rows += historian_.status(i).waiting;
  spdlog::error(
      "the disk does not answer: {}; lost: {} waiting rows of recordings, {} lines of the "
      "journal, {} pieces of evidence",
      fmt::join(hung, ", "), rows, journal_.status().waiting, evidence_.status().waiting);
}

void App::stop() {
  service_.stopping();
  stop_ = true;
  const std::int64_t deadline_ns =
      clock_.now_ns() + std::llround(configuration_.daemon.stop_timeout_s * 1e9);
  const auto all_there = [&] {
    return std::all_of(loops_.begin(), loops_.end(), [](const LoopRuntime& loop) {
      return loop.channels->stop_reached.load(std::memory_order_acquire);
    });
  };
  while (!all_there() && clock_.now_ns() < deadline_ns) {
    clock_.sleep_until_ns(clock_.now_ns() + kSecond / 100);
    attempt("events", [this] { log_events(); });
    attempt("watchdog", [this] { feed_watchdog(); });
  }
  quit_ = true;
  real_time_thread_.join();
  attempt("events", [this] { log_events(); });
  for_all_at_once(loops_.size(), [this](std::size_t i) {
    attempt("stop action", [&] { drive_to_stop(loops_[i]); });
  });
}

void App::drive_to_stop(LoopRuntime& loop) {
  const control::OutputAction action = loop.settings->get().safety.on_stop;
  if (action.kind == control::OutputAction::Kind::hold) return;
  std::string why;
  if (loop.io->drive(action.value, std::chrono::milliseconds(1000), why)) {
    spdlog::info("loop {}: output at {:.4g} {}", loop.config.name, action.value,
                 loop.config.co_unit);
  } else {
    spdlog::error("loop {}: output NOT at its stop value: {}", loop.config.name, why);
  }
}

ReloaderEnds App::reloader_ends() {
  return {.take_over =
              [this](const config::DaemonConfig& wanted) {
                configuration_.daemon.stop_timeout_s = wanted.stop_timeout_s;
                control_.set_rights(rights_of(wanted));
                spdlog::set_level(spdlog::level::from_str(wanted.log_level));
              },
          .reloading = [this] { service_.reloading(); },
          .ready = [this] { service_.ready(); }};
}

std::string App::rights_missing() const {
  const std::lock_guard lock(status_mutex_);
  return rights_missing_;
}

console::Parts App::console_parts() {
  return {
      .loops = loops_,
      .historian = historian_,
      .board = board_,
      .journal = journal_,
      .evidence = evidence_,
      .severe_percent = configuration_.daemon.alarms.severe_percent,
      .daemon_status = [this] { return status(); },
      .box_description = [this] { return description(); },
      .config_hash = [this] { return reloader_.config_hash(); },
      .reload = [this](const std::string& peer,
                       bool dry_run) { return reloader_.post(peer, dry_run); },
      .reload_state = [this](std::uint64_t number) { return reloader_.state(number); },
      .box = [this] { return box_reading(); },
      .modbus_server = [this] { return gateway_ ? gateway_->state() : gateway::ServerState{}; }};
}

protocol::Description App::description() const {
  const auto rights = [](const config::SocketRights& r) {
    return protocol::SocketRights{.alarms = r.alarms, .control = r.control};
  };
  const console::Rights now = control_.rights();
  const config::Alarms& alarms = configuration_.daemon.alarms;
  return {.version = LOOPWARDEN_VERSION,
          .config_hash = reloader_.config_hash(),
          .model_hash = model_hash_,
          .accelerate = configuration_.daemon.accelerate,
          .started_ms = started_ms_,
          .state_directory = configuration_.daemon.state_directory,
          .page = rights(now.page),
          .edge = rights(now.edge),
          .alarms = {.severe_percent = alarms.severe_percent,
                     .latching = alarms.settings.latching,
                     .shelve_limit_min = alarms.settings.shelve_limit_ms / 60'000}};
}

protocol::DaemonStatus App::status() const {
  rt::RunnerStatus runner;
  {
    const std::lock_guard lock(status_mutex_);
    runner = runner_status_;
  }
  const auto microseconds = [](std::int64_t ns) { return static_cast<double>(ns) / 1000.0; };
  const auto histogram = [&](const rt::LatencyHistogram& h) {
    return protocol::Histogram{.p50 = microseconds(h.quantile_ns(0.5)),
                               .p99 = microseconds(h.quantile_ns(0.99)),
                               .p99_9 = microseconds(h.quantile_ns(0.999)),
                               .worst = microseconds(h.worst_ns),
                               .sum = microseconds(h.sum_ns),
                               .bins = {h.bins.begin(), h.bins.end()}};
  };
  const journal::JournalStatus lines = journal_.status();
  const monitor::MonitorStatus watched = monitor_->status();
  const EvidenceStatus kept = evidence_.status();
  const ExplainerStatus explained = explainer_.status();
  std::optional<protocol::ModbusServer> server;
  if (gateway_) {
    const gateway::TcpServerCounters c = gateway_->counters();
    server = protocol::ModbusServer{.port = gateway_->port(),
                                    .clients = c.clients,
                                    .requests = c.requests,
                                    .accepted = c.accepted,
                                    .refused = c.refused,
                                    .displaced = c.displaced,
                                    .malformed = c.malformed};
    if (const auto serial = gateway_->serial_counters()) {
      server->serial = protocol::SerialServer{serial->open, serial->requests, serial->malformed};
    }
  }
  const std::int64_t now_ns = monotonic_ns();
  return {.version = LOOPWARDEN_VERSION,
          .config_hash = reloader_.config_hash(),
          .model_hash = model_hash_,
          .configuration = reloader_.status(),
          .recorder = {historian_.recorder().disk_wait_s()},
          .log_lines_lost = log_lines_lost_ ? log_lines_lost_() : 0,
          .journal = {.error = lines.error,
                      .file = journal_.path().string(),
                      .written = lines.written,
                      .waiting = lines.waiting,
                      .lost = lines.lost,
                      .damaged = lines.damaged},
          .evidence = {.error = kept.error,
                       .removal_error = kept.removal_error,
                       .written = kept.written,
                       .waiting = kept.waiting,
                       .lost = kept.lost},
          .explanations = {.explained = explained.explained,
                           .failed = explained.failed,
                           .waiting = explained.waiting},
          .monitor = {.windows = watched.windows,
                      .cycles = watched.cycles,
                      .dropped = watched.dropped,
                      .backlog = watched.backlog},
          .modbus_server = std::move(server),
          .uptime_s = static_cast<double>(now_ns - started_ns_) / 1e9,
          .accelerate = configuration_.daemon.accelerate,
          .real_time_missing = rights_missing(),
          .ticks = runner.ticks,
          .overruns = runner.overruns,
          .skipped_ticks = runner.skipped_ticks,
          .events_dropped = events_.dropped(),
          .wake_up_us = histogram(runner.wake_up),
          .work_us = histogram(runner.work)};
}

gateway::BoxReading App::box_reading() const {
  rt::RunnerStatus runner;
  {
    const std::lock_guard lock(status_mutex_);
    runner = runner_status_;
  }
  const journal::JournalStatus lines = journal_.status();
  const monitor::MonitorStatus watched = monitor_->status();
  gateway::BoxReading box;
  box.utc_ms = utc_ms();
  box.uptime_s = static_cast<double>(monotonic_ns() - started_ns_) / 1e9;
  box.overruns = runner.overruns;
  box.wake_up_worst_us = static_cast<double>(runner.wake_up.worst_ns) / 1000.0;
  box.wake_up_p99_us = static_cast<double>(runner.wake_up.quantile_ns(0.99)) / 1000.0;
  box.config_hash = reloader_.config_hash();
  box.model_hash = model_hash_;
  box.real_time_rights = rights_missing().empty();
  box.any_simulated = std::any_of(loops_.begin(), loops_.end(), [](const LoopRuntime& loop) {
    return is_simulated(loop.config);
  });
  box.journal_trouble = !lines.error.empty();
  box.journal_waiting = lines.waiting;
  box.journal_lost = lines.lost;
  box.window_backlog = watched.backlog;
  box.monitor_dropped = watched.dropped;
  return box;
}

int drive_to_stop_actions(const config::Configuration& configuration) {
  struct Drive {
    const config::LoopConfig* loop = nullptr;
    std::unique_ptr<hal::LoopIo> io;
    std::string why;
    bool there = false;
  };
  BackendFactory backends;
  std::vector<Drive> drives;
  for (const config::LoopConfig& loop : configuration.loops) {
    if (loop.safety.on_stop.kind == control::OutputAction::Kind::hold) {
      fmt::print("{}: stop action is hold; output left as it is\n", loop.name);
      continue;
    }
    Drive& drive = drives.emplace_back();
    drive.loop = &loop;
    try {
      drive.io = backends.make(loop);
    } catch (const std::exception& e) {
      drive.why = e.what();
    }
  }
  for_all_at_once(drives.size(), [&](std::size_t i) {
    Drive& drive = drives[i];
    if (!drive.io) return;
    try {
      drive.io->open();
      drive.there = drive.io->drive(drive.loop->safety.on_stop.value,
                                    std::chrono::milliseconds(3000), drive.why);
    } catch (const std::exception& e) {
      drive.why = e.what();
    }
  });
  int exit_code = kExitOk;
  for (Drive& drive : drives) {
    if (drive.io) drive.io->close();
    const double value = drive.loop->safety.on_stop.value;
    if (drive.there) {
      fmt::print("{}: output at {:g} {}\n", drive.loop->name, value, drive.loop->co_unit);
    } else {
      fmt::print(stderr, "{}: output NOT at {:g} {}: {}\n", drive.loop->name, value,
                 drive.loop->co_unit, drive.why);
      exit_code = kExitIo;
    }
  }
  return exit_code;
}

}  // namespace loopwarden::daemon
