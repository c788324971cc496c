// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <utility>

#include "base/local_server.hpp"
#include "daemon/console/journal_answer.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Executes operators' commands about alarms, incidents and corrective action, and stores their
// findings and notes. Each answer waits for the journal. Throws RequestError.
class AlarmCommands {
 public:
  AlarmCommands(const Plant& plant, journal::Journal& journal, Worked worked)
      : plant_(plant), journal_(journal), worked_(std::move(worked)) {}

  base::LocalServer::Answer alarm(const protocol::AlarmRequest& request, const Sender& sender);
  base::LocalServer::Answer acknowledge_incident(
      const protocol::AcknowledgeIncidentRequest& request, const Sender& sender);
  base::LocalServer::Answer acknowledge_all(const protocol::AcknowledgeAllRequest& request,
                                            const Sender& sender);
  base::LocalServer::Answer veto(const protocol::VetoRequest& request, const Sender& sender);
  base::LocalServer::Answer outcome(const protocol::OutcomeRequest& request, const Sender& sender);
  base::LocalServer::Answer note(const protocol::NoteRequest& request, const Sender& sender);

 private:
  std::string active_valve_alarms(std::size_t loop) const;

  Plant plant_;
  journal::Journal& journal_;
  Worked worked_;
};

}  // namespace loopwarden::daemon::console
