// SPDX-License-Identifier: Apache-2.0
// What operators do through the sockets: orders to the loops, actions on alarms, CSV records. Used by lw-control alone,
// which is the one writer of the loops' operator orders.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

#include "daemon/console/parts.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/loops/commissioning.hpp"
#include "daemon/orders/order_desk.hpp"
#include "base/local_server.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

class OperatorOrders {
 public:
  explicit OperatorOrders(const Parts& parts) : parts_(parts) {}
  OperatorOrders(const OperatorOrders&) = delete;
  OperatorOrders& operator=(const OperatorOrders&) = delete;

  // The answer to `set`, `tune`, `commissioning`, `order`, `record`, `alarm`, `acknowledge_incident`, `acknowledge_all`, `veto`, `outcome`, `note`, `report`, `reload` or `reload_state`; of what
  // operators do with alarms it comes when the journal has it on the disk, or says that it has not. Throws RequestError.
  base::LocalServer::Answer answer(std::string_view what, const nlohmann::json& request,
                                   const Sender& sender);

  // Takes the loops' answers that are there, and ends what is commissioned without a sign of life.
  void collect(Commissioning::Clock::time_point now = Commissioning::Clock::now());
  // The loops have ended: what is not answered is written down as not taken.
  void close();

 private:
  void refuse_watched(std::size_t loop) const;
  protocol::OrderTaken set(const protocol::SetRequest& request, const Sender& sender);
  protocol::OrderTaken tune(const protocol::TuneRequest& request, const Sender& sender);
  // Judges an order and lets it in. Throws RequestError; the journal has why. `text` is for the log.
  protocol::OrderTaken send(std::size_t loop, const rt::Order& order,
                            std::vector<journal::JournalEntry> lines, const std::string& peer,
                            const std::string& text);
  protocol::Commissioning commissioning(const protocol::CommissioningRequest& request,
                                        const Sender& sender);
  void write_down_commissioning(std::size_t loop, bool begun, const std::string& peer);
  // Of a loop whose commissioning shows no sign of life: it is given back once the stop action is taken.
  void end_silent(std::size_t loop, Commissioning::Clock::time_point now);
  rt::Order stop_order(std::size_t loop) const;
  // Why an order would be refused now; empty: it would not.
  std::string why_not(std::size_t loop, const rt::Order& order);
  protocol::OrderState order(const protocol::OrderRequest& request);
  protocol::RecordFile record(const protocol::RecordRequest& request, const Sender& sender);
  // Of records that nobody stops: with the commissioning in which they began, or after their time.
  void end_records(Commissioning::Clock::time_point now);
  base::LocalServer::Answer alarm(const protocol::AlarmRequest& request, const Sender& sender);
  base::LocalServer::Answer acknowledge_incident(
      const protocol::AcknowledgeIncidentRequest& request, const Sender& sender);
  base::LocalServer::Answer acknowledge_all(const protocol::AcknowledgeAllRequest& request,
                                            const Sender& sender);
  base::LocalServer::Answer veto(const protocol::VetoRequest& request, const Sender& sender);
  base::LocalServer::Answer outcome(const protocol::OutcomeRequest& request, const Sender& sender);
  base::LocalServer::Answer note(const protocol::NoteRequest& request, const Sender& sender);
  base::LocalServer::Answer report(const protocol::ReportRequest& request, const Sender& sender);
  // Throws RequestError where not all of it is recorded, or too little or too much.
  void check_span(const protocol::ReportRequest& request, reports::Kind kind,
                  std::size_t loop) const;
  // `reply`, with "on_disk".
  template <class Reply>
  base::LocalServer::Answer when_written(Reply reply, std::uint64_t ticket,
                                         const Sender& sender) const;
  protocol::ReloadState reload_state(const protocol::ReloadStateRequest& request);
  orders::OrderDesk& desk(std::size_t loop);
  // Lines for the journal, without their results: of an operator's action, of each part of an order.
  journal::JournalEntry line_of(std::size_t loop, const std::string& peer) const;
  std::vector<journal::JournalEntry> lines_of(const rt::Order& order, std::size_t loop,
                                              const std::string& peer) const;

  const Parts& parts_;
  // A stop action that is to be taken.
  struct Ending {
    std::optional<std::uint64_t> order{};  // on its way
    std::string refused{};                 // why it was, last time
    Commissioning::Clock::time_point next{};
  };
  std::map<std::size_t, Ending> endings_;  // by loop
  // A CSV record that ends by itself.
  struct EndingRecord {
    std::string file{};
    std::optional<std::uint64_t> session{};  // of the commissioning
    Commissioning::Clock::time_point until{};
  };
  std::map<std::size_t, EndingRecord> records_;  // by loop
  std::deque<orders::OrderDesk> desks_;          // one for each loop, from the first order on
};

}  // namespace loopwarden::daemon::console
