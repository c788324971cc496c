// SPDX-License-Identifier: Apache-2.0
// The state that a host application publishes about itself, retained on spBv1.0/STATE/HOST:
// {"online": true, "timestamp": MS}.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace loopwarden::sparkplug {

struct HostState {
  bool online = false;
  // since 1970, UTC: time of the host's connection, the same in its death
  std::uint64_t time_ms = 0;
  friend bool operator==(const HostState&, const HostState&) = default;
};

std::string to_text(const HostState& state);
// Returns nullopt if the text is not such an object.
std::optional<HostState> parse_host_state(std::string_view text);

// The state of the host in force. An older message has no effect, for example the will of a
// connection that a newer one has replaced.
class HostWatch {
 public:
  // Takes a message. Returns true if it is in force now.
  bool hear(const HostState& state);
  // Forgets the state. After a broker is restored from a backup, its retained message may be older
  // than earlier messages.
  void forget() { known_.reset(); }
  bool online() const noexcept { return known_ && known_->online; }

 private:
  std::optional<HostState> known_;
};

}  // namespace loopwarden::sparkplug
