// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <vector>

#include "hal/modbus/bus_waiter.hpp"
#include "hal/modbus/link_task.hpp"
#include "hal/modbus/modbus_settings.hpp"
#include "hal/modbus/modbus_transport.hpp"
#include "hal/modbus/reply_lengths.hpp"
#include "base/thread.hpp"

namespace loopwarden::hal::modbus {

// A change worth a line in the log. A link that changes often reports each change; who logs them
// limits the lines (base/line_limiter.hpp).
struct LinkEvent {
  enum class Kind : std::uint8_t {
    connected,
    connect_failed,
    disconnected,
    unit_silent,
    unit_back,
    device_error,
    watchdog_set,
    watchdog_refused,
    watchdog_lost,  // the device has forgotten it: it restarted
    commands_withheld,
    closes_connections,  // the device, after each reply or a few; nothing is wrong
    echo,                // the line gives back what is sent
    stray_bytes
  };
  Kind kind;
  std::string link;
  std::string subject;  // the unit or the task it is about; empty: the link
  std::string text;
};

// Called on bus threads, on several at a time if there are several links. Must not throw, nor block
// for long.
using EventSink = std::function<void(const LinkEvent&)>;

// One serial line, or one TCP connection, with a thread of its own that serves every task at
// absolute deadlines and retries for ever.
//
// What keeps a late reply from passing for a fresh one: on TCP the transaction number, and a new
// connection after any failure. A serial reply carries no number, so after a failure the unit is
// first asked something whose reply has a length that no point of the unit has (a barrier). A unit
// answers in order: once the barrier is answered nothing older can follow.
class ModbusLink {
 public:
  // Starts the thread.
  ModbusLink(LinkSettings settings, EventSink sink);
  ModbusLink(const ModbusLink&) = delete;
  ModbusLink& operator=(const ModbusLink&) = delete;
  ~ModbusLink();

  const LinkSettings& settings() const noexcept { return settings_; }

  // Any thread but the bus thread. The task is served from attach() until detach() returns.
  void attach(LinkTask& task);
  void detach(LinkTask& task) noexcept;
  // Serves the task now, back-off or not.
  void serve_soon(LinkTask& task) noexcept;

  std::uint64_t ticks() const noexcept { return waiter_.ticks(); }
  std::uint64_t reconnects() const noexcept { return reconnects_.load(std::memory_order_relaxed); }

 private:
  // What is known of one unit on the link.
  struct Unit {
    int failures = 0;           // in a row
    std::uint64_t answers = 0;  // since the start
    std::uint64_t epoch = 0;    // a new one whenever the unit may have restarted
    bool silence_reported =
        false;  // not on TCP where a unit has its own connection; the next as well
    std::int64_t retry_at_ns = 0;   // not asked before
    bool barrier_needed = false;    // serial only, as below
    std::int64_t unsettled_ns = 0;  // last instant that could have left a reply on its way
  };
  // Who is going to be asked, and a read of it that is likely to be understood.
  struct Target {
    std::uint8_t unit;
    ReadFunction function;
    std::uint16_t address;
  };
  enum class Asked : std::uint8_t {
    valid,
    exception,
    failed,     // no reply, or none that answers the request
    not_asked,  // no connection, or the unit is silent and not due
    stopped     // the bus thread is to end
  };
  static constexpr int kFailuresOfDeadUnit = 3;  // in a row
  enum class Purpose : std::uint8_t { value, barrier };
  // The request is refused for good, not just now.
  static bool refused(Asked asked, const Reply& reply) noexcept;

  bool is_tcp() const noexcept { return settings_.transport == Transport::tcp; }
  void run();
  bool take_due_tasks(std::int64_t now_ns, std::int64_t& next_ns);
  int most_together() const;  // registers
  void forget_back_off();
  void give_back();

  void serve(LinkTask& task);
  void serve_together(std::span<LinkTask* const> tasks);
  void part(std::span<LinkTask* const> tasks);
  void serve_read(LinkTask& task, ReadPoint& point);
  void note_unread(LinkTask& task, ReadPoint& point, Asked asked, const Reply& reply);
  void note_silence(const LinkTask& task, ReadPoint& point);
  static bool passes(Silence& silence, const Unit& unit) noexcept;
  // Asked ever more rarely from now on.
  static bool is_dead(const Unit& unit) noexcept { return unit.failures >= kFailuresOfDeadUnit; }
  static void retry_soon(LinkTask& task) noexcept;
  void publish_good(LinkTask& task, ReadPoint& point, double value, std::int64_t asked_ns);
  void publish_bad(const LinkTask& task, ReadPoint& point, Reason reason,
                   const std::string& more = {});
  void report_error(const LinkTask& task, const std::string& more);
  void note_connected(LinkTask& task);
  void serve_command(LinkTask& task, CommandPoint& point);
  void note_unwritten(LinkTask& task, CommandPoint& point, Reason reason,
                      std::int64_t tolerated_ns);
  Asked ensure_watchdog(LinkTask& task, CommandPoint& point, Reply& reply);
  Asked set_watchdog(LinkTask& task, CommandPoint& point, Reply& reply);
  bool watchdog_forgotten(LinkTask& task, CommandPoint& point);
  bool all_units_answer(const LinkTask& task);

  Unit& unit_of(std::uint8_t id);
  bool ensure_connected();
  bool ready(LinkTask& task, const Target& target);
  void discard_unasked(LinkTask& task);
  Asked ask(LinkTask& task, const Request& request, Reply& reply);
  Asked read(LinkTask& task, ReadShape& shape, Reply& reply);
  void shorten(ReadShape& shape);
  Asked exchange(LinkTask& task, const Request& request, Reply& reply, Purpose purpose);
  bool pass_barrier(LinkTask& task, const Target& target);
  void note_answer(const Request& request);
  void note_failure(const Request& request);
  // `expected`: closed for the sake of a unit that is known to be silent.
  void note_lost_connection(bool expected = false);
  void note_closing(std::size_t replies);
  void note_oddities();
  std::int64_t back_off_ns(int doublings, double first_s, double longest_s);
  void report(LinkEvent::Kind kind, std::string text, std::string subject = {}) const;

  const LinkSettings settings_;
  const EventSink sink_;
  BusWaiter waiter_;
  std::atomic<std::uint64_t> reconnects_{0};

  std::mutex mutex_;  // tasks_, in_service_ and lengths_; never held while waiting for the bus
  std::condition_variable served_;
  std::vector<LinkTask*> tasks_;
  std::vector<LinkTask*>
      in_service_;  // several where one request reads for them; changed by the bus thread
  ReplyLengths lengths_;

  // Bus thread only.
  ModbusTransport transport_;
  std::map<std::uint8_t, Unit> units_;
  std::optional<std::uint8_t> last_asked_;
  int connection_failures_ = 0;  // in a row; on TCP also requests without a proper reply
  // How the device ends connections: so many in a row after the same number of replies.
  int closings_ = 0;
  std::size_t replies_each_ = 0;
  bool closes_ = false;  // it always does: that is no failure, and each connection ends here
  bool opened_before_ = false;
  bool working_ = false;  // an answer has come and nothing has failed since
  bool spoiled_ = false;  // a reply came to the last request, but not a proper one
  bool failure_reported_ = false;
  std::int64_t reconnect_at_ns_ = 0;
  std::uint64_t epochs_ = 0;
  std::minstd_rand jitter_;

  base::Thread thread_;  // last: everything above is there when it starts
};

}  // namespace loopwarden::hal::modbus
