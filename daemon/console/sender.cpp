// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/sender.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {
namespace {

constexpr std::size_t kLongestName = 64;

std::string sound(const protocol::Maybe<std::string>& given, const char* key) {
  if (!given) return {};
  const std::string& name = *given;
  constexpr std::string_view kNotInNames = "\"'`\\@";
  const bool is_sound =
      !name.empty() && name.size() <= kLongestName &&
      std::all_of(name.begin(), name.end(), [&](char c) {
        return c > ' ' && c <= '~' && kNotInNames.find(c) == std::string_view::npos;
      });
  if (!is_sound) {
    throw RequestError(fmt::format(
        "{}: 1 to {} printable characters of ASCII, none of them a blank, a quote, \\ or @", key,
        kLongestName));
  }
  return name;
}

}  // namespace

Sender sender_of(const protocol::Person& person, SocketName socket, unsigned uid) {
  if (socket == SocketName::control || socket == SocketName::status) {
    if (person.user || person.address) {
      throw RequestError("user and address can be named on page.sock and edge.sock alone");
    }
    return {socket, fmt::format("uid {}", uid)};
  }
  const std::string user = sound(person.user, "user");
  const std::string address = sound(person.address, "address");
  const std::string who = user + (user.empty() || address.empty() ? "" : "@") + address +
                          (user.empty() && address.empty() ? "" : " by ");
  return {socket, fmt::format("{}{} (uid {})", who, to_text(socket), uid)};
}

}  // namespace loopwarden::daemon::console
