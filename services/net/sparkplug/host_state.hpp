// SPDX-License-Identifier: Apache-2.0
// What a host application says of itself, retained on spBv1.0/STATE/HOST: {"online": true, "timestamp": MS}.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace loopwarden::sparkplug {

struct HostState {
  bool online = false;
  std::uint64_t time_ms = 0;  // since 1970, UTC: of the host's connection, the same in its death
  friend bool operator==(const HostState&, const HostState&) = default;
};

std::string to_text(const HostState& state);
// Returns nullopt if the text is no such object.
std::optional<HostState> parse_host_state(std::string_view text);

// The state that counts. An older word, such as the will of a connection that a newer one has replaced, changes
// nothing.
class HostWatch {
 public:
  // True if it now counts.
  bool hear(const HostState& state);
  // A retained word may be older than all that was heard before: the broker may have been set back.
  void forget() { known_.reset(); }
  bool online() const noexcept { return known_ && known_->online; }

 private:
  std::optional<HostState> known_;
};

}  // namespace loopwarden::sparkplug
