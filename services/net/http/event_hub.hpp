// SPDX-License-Identifier: Apache-2.0
// What the stream of events has to say: of each kind only the newest. A client that does not keep up skips to it,
// so no client has a queue. One thread.
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

// The last frame of a stream whose reader may not stay.
inline constexpr std::string_view kEndOfStream = "event: ended\ndata: {}\n\n";

class EventHub {
 public:
  // Where one client stands.
  struct Cursor {
    std::array<std::uint64_t, kEventKinds> seen{};
  };

  // `data` is one line.
  void publish(EventKind kind, std::string_view data);
  // What the client has not got yet, in the order of the kinds.
  std::vector<Frame> news(Cursor& cursor) const;
  // Of a client that comes now: it gets the newest of all but `describe`, which only tells of changes.
  Cursor newcomer() const;

 private:
  struct Slot {
    std::uint64_t version = 0;
    Frame frame;
  };
  std::array<Slot, kEventKinds> slots_;
};

}  // namespace loopwarden::http
