// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "base/local_server.hpp"
#include "daemon/console/archive.hpp"
#include "daemon/console/daemon_info.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/loops/commissioning.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Starts and stops CSV records (`record`) and requests reports (`report`). Throws RequestError.
class RecordCommands {
 public:
  RecordCommands(const Plant& plant, const Archive& archive, const DaemonInfo& info)
      : plant_(plant), archive_(archive), info_(info) {}

  protocol::RecordFile record(const protocol::RecordRequest& request, const Sender& sender);
  base::LocalServer::Answer report(const protocol::ReportRequest& request, const Sender& sender);
  // Prepares the receipt of work at the loop that ends now. It is made when enough is recorded.
  void receipt(std::size_t loop, const std::string& peer);
  // Stops each record whose time is over or whose commissioning has ended.
  void end_records(Commissioning::Clock::time_point now);

 private:
  using Clock = Commissioning::Clock;
  // A record that ends without a request.
  struct EndingRecord {
    std::string file{};
    std::optional<std::uint64_t> session{};  // of the commissioning
    Clock::time_point until{};
  };
  void limit(std::size_t loop, const std::string& file, const protocol::RecordRequest& request);
  void stop_ended(std::size_t loop, const EndingRecord& record, const char* reason);
  void check_span(const protocol::ReportRequest& request, reports::Kind kind,
                  std::size_t loop) const;

  Plant plant_;
  Archive archive_;
  const DaemonInfo& info_;
  std::map<std::size_t, EndingRecord> records_;  // by loop
  Clock::time_point next_look_{};                // at receipts that are due
};

}  // namespace loopwarden::daemon::console
