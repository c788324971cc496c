// SPDX-License-Identifier: Apache-2.0
// What the sockets show: answers the requests that only read. Each socket thread has one of its own, so that none waits
// for another's disk.
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "daemon/console/parts.hpp"
#include "base/errand/disk_errand.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

class Readings {
 public:
  // `reader`: name of the thread that reads journal and evidence.
  Readings(const Parts& parts, const char* reader) : parts_(parts), reader_(reader) {}
  Readings(const Readings&) = delete;
  Readings& operator=(const Readings&) = delete;

  void start() { reader_.start(); }
  void stop() { reader_.stop(); }
  // As stop(), for at most `patience`; false if the disk hangs.
  bool stop_for(std::chrono::milliseconds patience) { return reader_.stop_for(patience); }

  // The answer to a request that reads. Throws RequestError.
  std::string answer(std::string_view what, const nlohmann::json& request);

 private:
  std::string status() const;
  protocol::Trend trend(const protocol::TrendRequest& request) const;
  std::string alarms() const;
  protocol::AlarmDesigns alarm_design(const protocol::AlarmDesignRequest& request) const;
  protocol::AlarmFigures alarm_figures(const protocol::AlarmFiguresRequest& request);
  protocol::Description describe() const;
  protocol::LoopAnswer loop(const protocol::LoopRequest& request) const;
  protocol::Windows windows(const protocol::WindowsRequest& request) const;
  protocol::Reports reports(const protocol::ReportsRequest& request) const;
  protocol::Explained explain(const protocol::ExplainRequest& request);
  protocol::Explained explain_box(const protocol::ExplainRequest& request);
  protocol::Journal journal(const protocol::JournalRequest& request);

  const Parts& parts_;
  // The disk is its own: a request that needs it waits for a second at most, all others not at all.
  base::DiskErrand reader_;
};

// What a request names. Throws RequestError.
std::size_t loop_index(const Parts& parts, const std::string& name);
alarm::AlarmKind wanted_alarm(const std::string& name);
alarm::BoxAlarm wanted_box_alarm(const std::string& name);

// Requests that need the disk wait so long for it. Other peers wait as long, once: behind a disk that hangs already
// nobody waits.
inline constexpr std::chrono::milliseconds kReaderPatience{1000};

}  // namespace loopwarden::daemon::console
