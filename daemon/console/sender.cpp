// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/sender.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <string_view>

#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {
namespace {

constexpr std::size_t kLongestName = 64;

std::string name_of(const nlohmann::json& request, const char* key) {
  if (!request.contains(key)) return {};
  std::string name = wanted_text(request, key);
  constexpr std::string_view kNotInNames = "\"'`\\@";
  const bool sound = !name.empty() && name.size() <= kLongestName &&
                     std::all_of(name.begin(), name.end(), [&](char c) {
                       return c > ' ' && c <= '~' && kNotInNames.find(c) == std::string_view::npos;
                     });
  if (!sound) {
    throw RequestError(fmt::format(
        "{}: 1 to {} printable characters of ASCII, none of them a blank, a quote, \\ or @", key,
        kLongestName));
  }
  return name;
}

}  // namespace

Sender sender_of(const nlohmann::json& request, SocketName socket, unsigned uid) {
  if (socket == SocketName::control || socket == SocketName::status) {
    if (request.contains("user") || request.contains("address")) {
      throw RequestError("user and address can be named on page.sock and edge.sock alone");
    }
    return {socket, fmt::format("uid {}", uid)};
  }
  const std::string user = name_of(request, "user");
  const std::string address = name_of(request, "address");
  const std::string who = user + (user.empty() || address.empty() ? "" : "@") + address +
                          (user.empty() && address.empty() ? "" : " by ");
  return {socket, fmt::format("{}{} (uid {})", who, to_text(socket), uid)};
}

}  // namespace loopwarden::daemon::console
