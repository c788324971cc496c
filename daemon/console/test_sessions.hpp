// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "daemon/console/loop_commands.hpp"
#include "daemon/console/operations.hpp"
#include "daemon/console/plant.hpp"
#include "daemon/console/sender.hpp"
#include "daemon/journal/journal.hpp"
#include "daemon/loops/commissioning.hpp"
#include "daemon/protocol/requests.hpp"

namespace loopwarden::daemon::console {

// Carries out the moves of a test, on one loop of the box at a time.
//
// Each move is checked against the limits in force. The test ends if PV or CO leaves its limits,
// if a process alarm or a fault is active, if the mode changes, if a known valve position is lost,
// if its time is over, or without a sign of life. However it ends, the loop returns to its mode,
// set point and output from before. A person or master that takes the loop to manual keeps it.
class TestSessions {
 public:
  using Clock = Commissioning::Clock;
  // Largest distance of a move from its start, as a share of the span of PV or CO.
  static constexpr double kMostMove = 0.05;
  static constexpr double kLongest_s = 3600.0;           // of the loop's time
  static constexpr double kLongestOfAny_s = 8 * 3600.0;  // the same with `any_size`

  TestSessions(const Plant& plant, journal::Journal& journal, LoopCommands& commands,
               const Operations& operations)
      : plant_(plant), journal_(journal), commands_(commands), operations_(operations) {}

  // Takes the loop and returns the session. Throws RequestError with the reason if the loop is not
  // fit for this test.
  std::uint64_t begin(std::size_t loop, const protocol::TestTerms& terms, const Sender& sender,
                      Clock::time_point at);
  // Moves SP or the output. Throws RequestError; the loop then stays as it is.
  void move(std::size_t loop, double to);
  // Ends the test of this loop. The loop is released when it is restored.
  void end(std::size_t loop, const std::string& why);
  bool runs_on(std::size_t loop) const noexcept { return test_ && test_->loop == loop; }
  void tick(Clock::time_point now);

 private:
  enum class Ending : std::uint8_t { output, mode };
  struct Test {
    std::size_t loop;
    std::uint64_t session;
    protocol::TestTerms terms;
    std::string peer;
    // State before the test.
    control::Mode mode;
    double set_point;  // PV units
    double output;     // CO units
    bool read_back;    // the valve position is known

    std::uint64_t first_period;
    std::uint64_t next_period;               // first row that was not checked yet
    double moved;                            // newest SP or output
    std::optional<std::uint64_t> command{};  // without an answer yet
    std::string why{};                       // the reason of the end; empty: it runs
    Ending ending = Ending::output;
    Clock::time_point next_try{};
    Clock::time_point wait_until{};  // for the output to return
  };

  std::string why_not_now(const Test& test) const;
  std::string why_beyond(const Test& test, double to) const;
  std::string why_in_rows(Test& test) const;
  void check_command(Test& test);
  void restore(Test& test, Clock::time_point now);
  void restore_output(Test& test, Clock::time_point now);
  rt::Command last_command(const Test& test);
  void taken_over(const Test& test);
  bool send(Test& test, const rt::Command& command);
  void write_down(const Test& test, const char* state, const std::string& reason);

  Plant plant_;
  journal::Journal& journal_;
  LoopCommands& commands_;
  const Operations& operations_;
  std::optional<Test> test_;
};

}  // namespace loopwarden::daemon::console
