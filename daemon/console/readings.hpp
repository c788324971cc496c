// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <string>
#include <string_view>

#include <nlohmann/json_fwd.hpp>

#include "daemon/console/archive.hpp"
#include "daemon/console/daemon_info.hpp"
#include "daemon/console/plant.hpp"
#include "base/blocking/blocking_worker.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Answers the requests that only read, from a table of requests. Each socket thread has one object,
// so that no socket waits for the disk of another one.
class Readings {
 public:
  // `reader`: name of the thread that reads journal and evidence.
  Readings(const Plant& plant, const Archive& archive, const DaemonInfo& info, const char* reader)
      : plant_(plant), archive_(archive), info_(info), reader_(reader) {}
  Readings(const Readings&) = delete;
  Readings& operator=(const Readings&) = delete;

  void start() { reader_.start(); }
  void stop() { reader_.stop(); }
  // As stop(), but waits at most `patience`. Returns false if the disk does not answer.
  bool stop_for(std::chrono::milliseconds patience) { return reader_.stop_for(patience); }

  static bool offers(std::string_view name) noexcept;
  // Returns the answer to the request `name`. Throws RequestError.
  std::string answer(std::string_view name, const nlohmann::json& request);

 private:
  struct Request;
  static const Request* find(std::string_view name) noexcept;
  std::string status() const;
  protocol::Trend trend(const protocol::TrendRequest& request) const;
  std::string alarms() const;
  protocol::AlarmDesigns alarm_design(const protocol::AlarmDesignRequest& request) const;
  protocol::AlarmFigures alarm_figures(const protocol::AlarmFiguresRequest& request);
  protocol::Description describe() const;
  protocol::LoopAnswer loop(const protocol::LoopRequest& request) const;
  protocol::TwinModel twin(const protocol::TwinRequest& request) const;
  protocol::Windows windows(const protocol::WindowsRequest& request) const;
  protocol::Reports reports(const protocol::ReportsRequest& request) const;
  protocol::Explained explain(const protocol::ExplainRequest& request);
  protocol::Explained explain_box(const protocol::ExplainRequest& request);
  protocol::Journal journal(const protocol::JournalRequest& request);

  Plant plant_;
  Archive archive_;
  const DaemonInfo& info_;
  base::BlockingWorker reader_;
};

// Longest wait of a request for the disk. Other peers wait for the first such request only: while
// the disk does not answer, further requests fail at once.
inline constexpr std::chrono::milliseconds kReaderPatience{1000};

}  // namespace loopwarden::daemon::console
