// SPDX-License-Identifier: Apache-2.0
// loopwarden_fleet_boxes: many simulated boxes in one program, for lab/bench/fleet.
//
// Prints a line of JSON each second: {"live", "sent", "again", "stored", "births"}. On SIGTERM, or
// after --seconds, it takes no more samples and sends the stored ones. The last line has the final
// count of each loop.
#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <csignal>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "lab/bench/fleet_kit/box.hpp"

namespace {

using loopwarden::bench::Box;
using loopwarden::bench::BoxSettings;
using Boxes = std::vector<std::unique_ptr<Box>>;

volatile std::sig_atomic_t g_asked_to_end = 0;

struct Options {
  std::string broker = "mqtt://127.0.0.1";
  std::vector<std::string> groups{"A"};
  std::string host = "loopwarden";
  std::string client_suffix;
  int boxes = 300;
  int loops = 20;
  double period_s = 10.0;
  double seconds = 60.0;
  double drain_s = 120.0;
  std::int64_t count_from = 0;
  int births_to_lose = 0;
};

std::int64_t now_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

Boxes make_boxes(const Options& options) {
  Boxes boxes;
  for (int i = 0; i < options.boxes; ++i) {
    const std::string& group = options.groups[static_cast<std::size_t>(i) % options.groups.size()];
    BoxSettings settings;
    settings.broker = loopwarden::mqtt::parse_broker_url(options.broker);
    settings.group = group;
    settings.edge = fmt::format("box{:04}", i);
    settings.host = options.host.empty() ? "" : options.host + '-' + group;
    settings.client_suffix = options.client_suffix;
    settings.loops = options.loops;
    settings.period_ms = static_cast<std::int64_t>(options.period_s * 1e3);
    settings.offset_ms = settings.period_ms * i / options.boxes / options.loops;
    settings.count_from = options.count_from;
    settings.births_to_lose = options.births_to_lose;
    boxes.push_back(std::make_unique<Box>(settings));
  }
  return boxes;
}

nlohmann::json state_of(const Boxes& boxes) {
  std::int64_t live = 0;
  std::int64_t sent = 0;
  std::int64_t again = 0;
  std::int64_t births = 0;
  std::size_t stored = 0;
  for (const auto& box : boxes) {
    live += box->live() ? 1 : 0;
    sent += box->sent();
    again += box->sent_again();
    births += box->births();
    stored += box->stored();
  }
  return {{"live", live}, {"sent", sent}, {"again", again}, {"stored", stored}, {"births", births}};
}

bool all_drained(const Boxes& boxes) {
  for (const auto& box : boxes) {
    if (!box->drained()) return false;
  }
  return true;
}

void print(const nlohmann::json& line) {
  fmt::print("{}\n", line.dump());
  std::fflush(stdout);
}

void run(Boxes& boxes, double seconds, bool sample, bool until_drained) {
  using Clock = std::chrono::steady_clock;
  const auto start = Clock::now();
  auto told = start;
  while (Clock::now() - start < std::chrono::duration<double>(seconds)) {
    if (sample && g_asked_to_end != 0) return;
    for (const auto& box : boxes) box->tick(now_ms(), sample);
    if (until_drained && all_drained(boxes)) return;
    if (Clock::now() - told > std::chrono::seconds(1)) {
      told += std::chrono::seconds(1);
      print(state_of(boxes));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
}

void tell_numbers(const Boxes& boxes) {
  nlohmann::json result = state_of(boxes);
  nlohmann::json numbers;
  for (const auto& box : boxes) {
    nlohmann::json& of = numbers[box->settings().group + '/' + box->settings().edge];
    for (int loop = 0; loop < box->settings().loops; ++loop) of.push_back(box->newest_number(loop));
  }
  result["numbers"] = numbers;
  print(result);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App cli("loopwarden_fleet_boxes - simulated boxes");
  Options options;
  cli.add_option("--broker", options.broker);
  cli.add_option("--groups", options.groups)->delimiter(',');
  cli.add_option("--host", options.host,
                 "HOST-GROUP is each box's primary host; empty: no primary host");
  cli.add_option("--client-suffix", options.client_suffix);
  cli.add_option("--boxes", options.boxes);
  cli.add_option("--loops", options.loops);
  cli.add_option("--period", options.period_s, "s, between a loop's messages");
  cli.add_option("--seconds", options.seconds);
  cli.add_option("--drain", options.drain_s, "s, at most, to send stored values");
  cli.add_option("--count-from", options.count_from, "each loop's first value is one more");
  cli.add_option("--lose-births", options.births_to_lose);
  CLI11_PARSE(cli, argc, argv);
  std::signal(SIGTERM, [](int) { g_asked_to_end = 1; });
  Boxes boxes = make_boxes(options);
  run(boxes, options.seconds, true, false);
  run(boxes, options.drain_s, false, true);
  tell_numbers(boxes);
  for (const auto& box : boxes) box->leave();
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  return 0;
}
