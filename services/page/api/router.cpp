// SPDX-License-Identifier: Apache-2.0
#include "services/page/api/router.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <exception>
#include <functional>
#include <span>
#include <string_view>
#include <utility>

#include "services/page/api/gate.hpp"
#include "services/page/api/handlers.hpp"
#include "services/net/http/response_head.hpp"
#include "record/record_csv.hpp"

namespace loopwarden::page::api {
namespace {

using http::Method;
using http::Pool;
using http::Request;
using http::Response;

// The part of page.yaml that a path requires.
enum class Of { page, box, fleet };

struct Route {
  Of of;
  Method method;
  std::string_view path;  // "*" is any part; "**", the last, any number of them
  Pool pool;
  Role role;
  Response (*handle)(Context&, const Call&);
};

constexpr std::array kRoutes{
    Route{Of::page, Method::get, "api/session", Pool::here, Role::none, session},
    Route{Of::box, Method::get, "api/describe", Pool::daemon, Role::viewer, describe},
    Route{Of::box, Method::get, "api/events", Pool::here, Role::viewer, events},
    Route{Of::box, Method::get, "api/sparklines", Pool::daemon, Role::viewer, sparklines},
    Route{Of::box, Method::get, "api/alarms", Pool::here, Role::viewer, alarms},
    Route{Of::box, Method::get, "api/alarm-figures", Pool::daemon, Role::viewer, alarm_figures},
    Route{Of::box, Method::get, "api/system", Pool::daemon, Role::viewer, system},
    Route{Of::box, Method::get, "api/loops/*", Pool::daemon, Role::viewer, loop},
    Route{Of::box, Method::get, "api/loops/*/windows", Pool::daemon, Role::viewer, windows},
    Route{Of::box, Method::get, "api/loops/*/history", Pool::disk, Role::viewer, past},
    Route{Of::box, Method::get, "api/loops/*/history.csv", Pool::disk, Role::viewer, past_csv},
    Route{Of::box, Method::get, "api/loops/*/alarms", Pool::daemon, Role::viewer, loop_alarms},
    Route{Of::box, Method::get, "api/loops/*/tuning", Pool::disk, Role::engineer, proposed_gains},
    Route{Of::box, Method::get, "api/loops/*/test", Pool::disk, Role::viewer, planned_test},
    Route{Of::box, Method::get, "api/loops/*/alarms/*", Pool::daemon, Role::viewer, loop_alarm},
    Route{Of::box, Method::get, "api/loops/*/reports", Pool::disk, Role::viewer, loop_reports},
    Route{Of::box, Method::get, "api/journal", Pool::daemon, Role::viewer, journal},
    Route{Of::box, Method::get, "api/journal.csv", Pool::daemon, Role::viewer, journal_csv},
    Route{Of::box, Method::get, "api/evidence/*", Pool::disk, Role::viewer, evidence},
    Route{Of::box, Method::get, "api/reports", Pool::disk, Role::viewer, reports},
    Route{Of::box, Method::get, "reports/**", Pool::disk, Role::viewer, report},
    Route{Of::fleet, Method::get, "api/fleet", Pool::fleet, Role::viewer, fleet_overview},
    Route{Of::fleet, Method::get, "api/fleet/valves/*/*/*", Pool::fleet, Role::viewer, fleet_valve},
    Route{Of::page, Method::post, "api/login", Pool::log_in, Role::none, log_in},
    Route{Of::page, Method::post, "api/logout", Pool::here, Role::none, log_out},
    Route{Of::box, Method::post, "api/loops/*/alarms/*", Pool::orders, Role::operator_,
          act_on_alarm},
    Route{Of::box, Method::post, "api/loops/*/incidents/*", Pool::orders, Role::operator_,
          acknowledge_incident},
    Route{Of::box, Method::post, "api/loops/*/notes", Pool::orders, Role::operator_, note},
    Route{Of::box, Method::post, "api/loops/*/reports", Pool::orders, Role::engineer,
          ask_for_report},
    Route{Of::box, Method::post, "api/loops/*/order", Pool::orders, Role::operator_, order},
    Route{Of::box, Method::post, "api/loops/*/tuning", Pool::orders, Role::engineer, tune},
    Route{Of::box, Method::post, "api/loops/*/test", Pool::orders, Role::operator_, act_on_test},
};

bool matches(std::string_view pattern, std::span<const std::string> path) {
  for (;;) {
    if (pattern.empty()) return path.empty();
    if (pattern == "**") return !path.empty();
    if (path.empty()) return false;
    const std::size_t end = std::min(pattern.find('/'), pattern.size());
    const std::string_view part = pattern.substr(0, end);
    if (part != "*" && part != path.front()) return false;
    pattern.remove_prefix(std::min(end + 1, pattern.size()));
    path = path.subspan(1);
  }
}

bool is_of(Method method, Method wanted) {
  return method == wanted || (method == Method::head && wanted == Method::get);
}

const Route* find(const Request& request) {
  for (const Route& route : kRoutes) {
    if (is_of(request.method, route.method) && matches(route.path, request.path)) return &route;
  }
  return nullptr;
}

// Returns the methods of the path; empty if there is no such path.
std::string allowed(const Request& request) {
  std::string methods;
  for (const Route& route : kRoutes) {
    if (!matches(route.path, request.path)) continue;
    if (!methods.empty()) methods += ", ";
    methods += route.method == Method::get ? "GET, HEAD" : "POST";
  }
  return methods;
}

Response wrong_method(const std::string& methods) {
  Response response = http::error_response(405, "that is not done with this address");
  response.headers.emplace_back("Allow", methods);
  return response;
}

bool is_ours(const Request& request) {
  return request.part(0) == "api" || request.part(0) == "reports";
}

void check_there(const Context& context, Of of) {
  if (of == Of::box && !context.settings.box) {
    throw ApiError(404, "this machine has no loopwardend (page.yaml: box: false)");
  }
  if (of == Of::fleet && context.fleet == nullptr) throw ApiError(404, "page.yaml has no fleet");
}

// Returns the answer for a thrown exception.
Response excuse(std::exception_ptr what) {
  try {
    std::rethrow_exception(what);
  } catch (const ApiError& e) {
    return http::error_response(e.status(), e.what(), e.field());
  } catch (const protocol::DaemonError& e) {
    return http::error_response(e.refused() ? 409 : 503, e.what());
  } catch (const fleet::FleetDown& e) {
    return http::error_response(503, e.what());
  } catch (const record::RecordError& e) {
    return http::error_response(e.kind() == record::RecordError::Kind::io ? 503 : 409, e.what());
  } catch (const std::exception& e) {
    spdlog::error("answer: {}", e.what());
    return http::error_response(500, "the page could not answer; its log has the reason");
  }
}

// Returns the response of `make`, or the answer for its exception. The same applies to the
// response's later rounds.
Response excused(const std::function<Response()>& make) noexcept {
  try {
    Response response = make();
    if (response.next) {
      response.next = [next = std::move(response.next)] { return excused(next); };
    }
    return response;
  } catch (...) {
    return excuse(std::current_exception());
  }
}

}  // namespace

http::Pool Router::pool(const Request& request) const noexcept {
  const Route* route = find(request);
  return route == nullptr ? Pool::here : route->pool;
}

Response Router::route(const Request& request) {
  check_host(context_, request);
  if (!is_ours(request)) {
    if (request.method != Method::get && request.method != Method::head) {
      return wrong_method("GET, HEAD");
    }
    return context_.site(request);
  }
  const Route* route = find(request);
  if (route == nullptr) {
    const std::string methods = allowed(request);
    return methods.empty() ? http::error_response(404, "there is no such address")
                           : wrong_method(methods);
  }
  const Identity who = identity_of(context_, request);
  // A page that a report opens has another origin, because it is in a sandbox.
  if (request.part(0) == "api") check_origin(request);
  if (route->method == Method::post) check_post(request, who);
  check_role(who, route->role);
  check_there(context_, route->of);
  return route->handle(context_, {request, who});
}

Response Router::answer(const Request& request) noexcept {
  return excused([&] { return route(request); });
}

}  // namespace loopwarden::page::api
