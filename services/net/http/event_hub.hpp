// SPDX-License-Identifier: Apache-2.0
// Holds the newest event of each kind for the event streams. A client that does not keep up skips
// to the newest one, so no client needs a queue. For one thread only.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace loopwarden::http {

enum class EventKind { daemon, describe, alarms, overview };
inline constexpr std::size_t kEventKinds = 4;

using Frame = std::shared_ptr<const std::string>;

// The last frame of a stream that may not stay.
inline constexpr std::string_view kEndOfStream = "event: ended\ndata: {}\n\n";

class EventHub {
 public:
  // The newest events that a client has received.
  struct Cursor {
    std::array<std::uint64_t, kEventKinds> seen{};
  };

  // Replaces the newest event of the kind. `data` must be one line.
  void publish(EventKind kind, std::string_view data);
  // Returns the events that the client has not received yet, in the order of the kinds.
  std::vector<Frame> news(Cursor& cursor) const;
  // Returns the cursor of a new client. It receives the newest event of each kind except
  // `describe`, which only reports changes.
  Cursor newcomer() const;

 private:
  struct Slot {
    std::uint64_t version = 0;
    Frame frame;
  };
  std::array<Slot, kEventKinds> slots_;
};

}  // namespace loopwarden::http
