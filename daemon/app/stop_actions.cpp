// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/stop_actions.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstddef>
#include <exception>
#include <memory>
#include <string>
#include <system_error>
#include <thread>

#include "base/exit_code.hpp"
#include "daemon/app/attempt.hpp"
#include "daemon/app/backend_factory.hpp"

namespace loopwarden::daemon {
namespace {

// Runs `step(i)` for all `count` at once, so that a dead device does not delay the others.
template <class Step>
void for_all_at_once(std::size_t count, Step step) {
  std::vector<std::thread> threads;
  threads.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    try {
      threads.emplace_back(step, i);
    } catch (const std::system_error&) {
      step(i);  // without another thread, runs it here
    }
  }
  for (std::thread& thread : threads) thread.join();
}

void drive_to_stop(LoopRuntime& loop) {
  if (loop.watched()) return;
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

// One output of `loopwardend --safe`.
struct Drive {
  const config::LoopConfig* loop = nullptr;
  std::string why;
  std::unique_ptr<hal::LoopIo> io{};
  bool there = false;

  void run(BackendFactory& backends) {
    try {
      io = backends.make(*loop);
      io->open();
      there = io->drive(loop->safety.on_stop.value, std::chrono::milliseconds(3000), why);
    } catch (const std::exception& e) {
      why = e.what();
    }
  }
  void print() const {
    const double value = loop->safety.on_stop.value;
    if (there) {
      fmt::print("{}: output at {:g} {}\n", loop->name, value, loop->co_unit);
    } else {
      fmt::print(stderr, "{}: output NOT at {:g} {}: {}\n", loop->name, value, loop->co_unit, why);
    }
  }
};

}  // namespace

void drive_to_stop(std::vector<LoopRuntime>& loops) {
  for_all_at_once(loops.size(),
                  [&](std::size_t i) { attempt("stop action", [&] { drive_to_stop(loops[i]); }); });
}

int drive_to_stop_actions(const std::vector<config::StopOutput>& outputs) {
  BackendFactory backends;
  std::vector<Drive> drives;
  int exit_code = kExitOk;
  for (const auto& [loop, why_not] : outputs) {
    if (!why_not.empty()) {
      fmt::print(stderr, "{}: output NOT driven, because its files give no valid stop action: {}\n",
                 loop.name, why_not);
      exit_code = kExitIo;
    } else if (loop.safety.on_stop.kind == control::OutputAction::Kind::hold) {
      fmt::print("{}: stop action is hold; output left as it is\n", loop.name);
    } else {
      drives.push_back({.loop = &loop, .why = {}});
    }
  }
  for_all_at_once(drives.size(), [&](std::size_t i) { drives[i].run(backends); });
  for (Drive& drive : drives) {
    if (drive.io) drive.io->close();
    drive.print();
    if (!drive.there) exit_code = kExitIo;
  }
  return exit_code;
}

}  // namespace loopwarden::daemon
