// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/link_log.hpp"

#include <spdlog/spdlog.h>

#include <utility>

namespace loopwarden::daemon {
namespace {

void write(const base::LimitedLine& line) {
  spdlog::log(line.good ? spdlog::level::info : spdlog::level::warn, "{}", line.text);
}

}  // namespace

void LinkLog::take(const hal::modbus::LinkEvent& event) {
  using Kind = hal::modbus::LinkEvent::Kind;
  const bool good = event.kind == Kind::connected || event.kind == Kind::unit_back ||
                    event.kind == Kind::watchdog_set || event.kind == Kind::closes_connections;
  // A remark is true together with the state of the link: it is a subject of its own.
  const bool remark = event.kind == Kind::closes_connections || event.kind == Kind::echo ||
                      event.kind == Kind::stray_bytes;
  const std::string kind = std::to_string(static_cast<int>(event.kind));
  take("link " + event.link + ' ' + (remark ? kind : event.subject), kind,
       {.good = good, .text = "link " + event.link + ": " + event.text});
}

void LinkLog::take(const hal::iio::AnalogEvent& event) {
  take(event.text.substr(0, event.text.find(": ")), event.good ? "good" : "bad",
       {.good = event.good, .text = event.text});
}

void LinkLog::take(const std::string& subject, const std::string& state, base::LimitedLine line) {
  const std::lock_guard lock(mutex_);
  const auto written =
      limiter_.take(subject, state, std::move(line), std::chrono::steady_clock::now());
  if (written) write(*written);
}

void LinkLog::look() {
  const std::lock_guard lock(mutex_);
  for (const base::LimitedLine& line : limiter_.due(std::chrono::steady_clock::now())) write(line);
}

}  // namespace loopwarden::daemon
