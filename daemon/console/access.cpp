// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/access.hpp"

#include <fmt/format.h>

#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {
namespace {

// The peers of edge.sock neither tune, nor read reports, nor test.
bool is_page_only(Need need) {
  return need == Need::tuning || need == Need::reports || need == Need::tests;
}

std::string elsewhere(const Access& access) {
  if (access.on_status) return "on status.sock and control.sock";
  if (is_page_only(access.need)) {
    return "on control.sock, and on page.sock where allowed";
  }
  return access.on_limited ? "on control.sock, and on page.sock and edge.sock where allowed"
                           : "on control.sock alone";
}

bool allowed(Need need, const config::SocketRights& rights) {
  switch (need) {
    case Need::nothing: return true;
    case Need::any: return rights.any();
    case Need::alarms: return rights.alarms;
    case Need::tuning: return rights.tuning;
    case Need::reports: return rights.reports;
    case Need::tests: return rights.tests;
    case Need::control: break;
  }
  return rights.control;
}

const char* right_for(Need need) {
  switch (need) {
    case Need::alarms: return "alarms";
    case Need::tuning: return "tuning";
    case Need::reports: return "reports";
    case Need::tests: return "tests";
    default: return "control";
  }
}

}  // namespace

const char* to_text(SocketName socket) noexcept {
  switch (socket) {
    case SocketName::control: return "control";
    case SocketName::status: return "status";
    case SocketName::page: return "page";
    case SocketName::edge: break;
  }
  return "edge";
}

config::SocketRights Rights::of(SocketName socket) const noexcept {
  if (socket == SocketName::page) return page;
  if (socket == SocketName::edge) return edge;
  return {.alarms = true, .control = true, .tuning = true, .reports = true, .tests = true};
}

void check_access(std::string_view request, const Access& access, SocketName socket,
                  const Rights& rights) {
  const bool limited = socket == SocketName::page || socket == SocketName::edge;
  const bool page_only = is_page_only(access.need) && socket == SocketName::edge;
  if ((socket == SocketName::status && !access.on_status) || (limited && !access.on_limited) ||
      page_only) {
    throw RequestError(fmt::format("{}.sock does not offer '{}'; it is {}", to_text(socket),
                                   request, elsewhere(access)));
  }
  if (limited && !allowed(access.need, rights.of(socket))) {
    throw RequestError(
        fmt::format("'{}' is not allowed on {}.sock: loopwardend.yaml needs {}: {{{}: true}}",
                    request, to_text(socket), to_text(socket), right_for(access.need)));
  }
}

}  // namespace loopwarden::daemon::console
