// SPDX-License-Identifier: Apache-2.0
#include "daemon/console/offers.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "daemon/console/request.hpp"

namespace loopwarden::daemon::console {
namespace {

// What a limited socket needs to be allowed for a request; some: any right.
enum class Need : std::uint8_t { nothing, some, alarms, control, tuning, reports };

struct Offer {
  std::string_view request;
  bool on_status;   // reading
  bool on_limited;  // on page.sock and edge.sock
  Need need;
};

// control.sock offers all of them.
constexpr std::array kOffers{
    Offer{"status", true, false, Need::nothing},
    Offer{"trend", true, false, Need::nothing},
    Offer{"alarms", true, false, Need::nothing},
    Offer{"alarm_design", true, false, Need::nothing},
    Offer{"alarm_figures", true, false, Need::nothing},
    Offer{"explain", true, false, Need::nothing},
    Offer{"journal", true, false, Need::nothing},
    Offer{"describe", true, false, Need::nothing},
    Offer{"links", true, false, Need::nothing},
    Offer{"setups", true, false, Need::nothing},
    Offer{"overview", true, false, Need::nothing},
    Offer{"loop", true, false, Need::nothing},
    Offer{"windows", true, false, Need::nothing},
    Offer{"twin", true, false, Need::nothing},
    Offer{"registers", true, false, Need::nothing},
    Offer{"reports", true, false, Need::nothing},
    Offer{"order", false, true, Need::some},
    Offer{"set", false, true, Need::control},
    Offer{"tune", false, true, Need::tuning},
    Offer{"commissioning", false, false, Need::nothing},
    Offer{"alarm", false, true, Need::alarms},
    Offer{"veto", false, true, Need::alarms},
    Offer{"note", false, true, Need::alarms},
    Offer{"report", false, true, Need::reports},
    Offer{"outcome", false, false, Need::nothing},
    Offer{"record", false, false, Need::nothing},
    Offer{"acknowledge_incident", false, true, Need::alarms},
    Offer{"acknowledge_all", false, true, Need::alarms},
    Offer{"reload", false, false, Need::nothing},
    Offer{"reload_state", false, false, Need::nothing},
};

std::string elsewhere(const Offer& offer) {
  if (offer.on_status) return "on status.sock and control.sock";
  if (offer.need == Need::tuning || offer.need == Need::reports) {
    return "on control.sock, and on page.sock where allowed";
  }
  return offer.on_limited ? "on control.sock, and on page.sock and edge.sock where allowed"
                          : "on control.sock alone";
}

bool allowed(Need need, const config::SocketRights& rights) {
  switch (need) {
    case Need::nothing: return true;
    case Need::some: return rights.any();
    case Need::alarms: return rights.alarms;
    case Need::tuning: return rights.tuning;
    case Need::reports: return rights.reports;
    case Need::control: break;
  }
  return rights.control;
}

const char* right_for(Need need) {
  switch (need) {
    case Need::alarms: return "alarms";
    case Need::tuning: return "tuning";
    case Need::reports: return "reports";
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
  return {.alarms = true, .control = true, .tuning = true, .reports = true};
}

bool is_order(std::string_view request) noexcept {
  return std::any_of(kOffers.begin(), kOffers.end(),
                     [&](const Offer& o) { return o.request == request && !o.on_status; });
}

void check_offered(std::string_view request, SocketName socket, const Rights& rights) {
  const auto* const offer = std::find_if(kOffers.begin(), kOffers.end(),
                                         [&](const Offer& o) { return o.request == request; });
  if (offer == kOffers.end()) throw RequestError(fmt::format("unknown request '{}'", request));
  const bool limited = socket == SocketName::page || socket == SocketName::edge;
  // The edge has nobody who tunes, or who would read a report.
  const bool of_page =
      (offer->need == Need::tuning || offer->need == Need::reports) && socket == SocketName::edge;
  if ((socket == SocketName::status && !offer->on_status) || (limited && !offer->on_limited) ||
      of_page) {
    throw RequestError(fmt::format("{}.sock does not offer '{}'; it is {}", to_text(socket),
                                   request, elsewhere(*offer)));
  }
  if (limited && !allowed(offer->need, rights.of(socket))) {
    throw RequestError(
        fmt::format("'{}' is not allowed on {}.sock: loopwardend.yaml needs {}: {{{}: true}}",
                    request, to_text(socket), to_text(socket), right_for(offer->need)));
  }
}

}  // namespace loopwarden::daemon::console
