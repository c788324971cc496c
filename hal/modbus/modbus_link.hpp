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

// A change worth a log line. A link that changes often reports each change; the receiver limits the
// lines (base/line_limiter.hpp).
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
    watchdog_lost,  // the device has lost the setting: it restarted
    commands_withheld,
    closes_connections,  // the device closes after one or a few replies; no fault
    echo,                // the line returns the bytes that are sent
    stray_bytes
  };
  Kind kind;
  std::string link;
  std::string subject;  // unit or task concerned; empty: the link
  std::string text;
};

// Called on bus threads, concurrently if there are several links. Must not throw, nor block for
// long.
using EventSink = std::function<void(const LinkEvent&)>;

// One serial line or one TCP connection with its own thread. The thread serves each task at
// absolute deadlines and retries without limit.
//
// A late reply can't be mistaken for a fresh one:
// - On TCP the transaction number differs, and each failure causes a new connection.
// - A serial reply has no number. After a failure the unit first gets a request whose reply has a
//   length that no point of the unit has (a barrier). A unit answers in order, so no older reply
//   can follow the answer to the barrier.
class ModbusLink {
 public:
  // Starts the thread.
  ModbusLink(LinkSettings settings, EventSink sink);
  ModbusLink(const ModbusLink&) = delete;
  ModbusLink& operator=(const ModbusLink&) = delete;
  ~ModbusLink();

  const LinkSettings& settings() const noexcept { return settings_; }

  // Any thread except the bus thread. The task is served from attach() until detach() returns.
  void attach(LinkTask& task);
  void detach(LinkTask& task) noexcept;
  // Serves the task now, regardless of back-off.
  void serve_soon(LinkTask& task) noexcept;

  std::uint64_t ticks() const noexcept { return waiter_.ticks(); }
  std::uint64_t reconnects() const noexcept { return reconnects_.load(std::memory_order_relaxed); }

 private:
  // State of one unit on the link.
  struct Unit {
    int failures = 0;           // in a row
    std::uint64_t answers = 0;  // since the start
    std::uint64_t epoch = 0;    // changes whenever the unit may have restarted
    bool silence_reported =
        false;  // not used on TCP if the unit has its own connection; the next neither
    std::int64_t retry_at_ns = 0;   // not read or written before this time
    bool barrier_needed = false;    // serial only, see the class comment
    std::int64_t unsettled_ns = 0;  // last time at which a reply may have been pending
  };
  // A unit to be asked, and a read that it probably supports.
  struct Target {
    std::uint8_t unit;
    ReadFunction function;
    std::uint16_t address;
  };
  enum class Asked : std::uint8_t {
    valid,
    exception,
    failed,     // no reply, or no valid one
    not_asked,  // no connection, or the unit is silent and not due
    stopped     // the bus thread must end
  };
  static constexpr int kFailuresOfDeadUnit = 3;  // in a row
  enum class Purpose : std::uint8_t { value, barrier };
  // Returns whether the device refuses the request permanently.
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
  // Returns whether the unit is now asked at growing intervals.
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
  // `expected`: closed because of a unit that is already reported as silent.
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
      in_service_;  // several if one request reads for them; changed by the bus thread
  ReplyLengths lengths_;

  // Bus thread only.
  ModbusTransport transport_;
  std::map<std::uint8_t, Unit> units_;
  std::optional<std::uint8_t> last_asked_;
  int connection_failures_ = 0;  // in a row; on TCP also requests without a proper reply
  // Consecutive closings by the device after the same number of replies.
  int closings_ = 0;
  std::size_t replies_each_ = 0;
  bool closes_ = false;  // the device always closes: no failure, and each connection is closed here
                         // first
  bool opened_before_ = false;
  bool working_ = false;  // an answer has arrived without a failure since
  bool spoiled_ = false;  // the last request got a reply, but an invalid one
  bool failure_reported_ = false;
  std::int64_t reconnect_at_ns_ = 0;
  std::uint64_t epochs_ = 0;
  std::minstd_rand jitter_;

  base::Thread thread_;  // last: it uses all members above when it starts
};

}  // namespace loopwarden::hal::modbus
