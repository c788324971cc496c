// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <array>
#include <ctime>
#include <nlohmann/json.hpp>

#include "services/page/api/body.hpp"
#include "services/page/api/gate.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/users/password.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

std::string host_of_this_box() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

// Of the process, which main() has given page.yaml's zone.
long utc_offset_s() {
  const std::time_t now = std::time(nullptr);
  std::tm local{};
  localtime_r(&now, &local);
  return local.tm_gmtoff;
}

json session_json(Context& context, const Identity& who) {
  const auto state = context.now().state;
  const bool acts = who.role >= Role::operator_;
  return {{"user", who.user.empty() ? json(nullptr) : json(who.user)},
          {"role", to_text(who.role)},
          {"csrf", who.csrf},
          {"login", context.users.has_file()},
          {"must_login", who.role == Role::none},
          {"can",
           {{"alarms", acts && state && state->about.page.alarms},
            {"control", acts && state && state->about.page.control && context.settings.control},
            {"tuning", who.role == Role::engineer && state && state->about.page.tuning},
            {"reports", who.role >= Role::engineer && state && state->about.page.reports}}},
          {"box", context.settings.box},
          {"fleet", context.fleet != nullptr},
          {"time_zone", context.settings.time_zone},
          {"utc_offset_s", utc_offset_s()},
          {"version", LOOPWARDEN_VERSION},
          {"host", host_of_this_box()}};
}

std::string cookie_text(const http::Request& request, const std::string& value, long seconds) {
  return fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict{}; Max-Age={}", kCookie, value,
                     request.secure ? "; Secure" : "", seconds);
}

http::Response too_often(unsigned wait_s) {
  http::Response response;
  response.status = 429;
  response.body = dump({{"error", fmt::format("too many tries; wait {} s", wait_s)}});
  response.headers.emplace_back("Retry-After", std::to_string(wait_s));
  return response;
}

}  // namespace

http::Response session(Context& context, const Call& call) {
  check_query(call.request, {});
  return json_response(session_json(context, call.who));
}

http::Response log_in(Context& context, const Call& call) {
  if (!context.users.has_file()) throw ApiError(403, "this page has no users");
  const json body = object_of(call.request, {"user", "password"});
  const std::string name = text_at(body, "user", 64);
  const std::string password = text_at(body, "password", kLongestPassword);
  const auto now = std::chrono::steady_clock::now();
  if (const unsigned wait_s = context.guard.wait_s(name, call.request.network, now)) {
    return too_often(wait_s);
  }
  const auto users = context.users.users();
  const auto user = users->find(name);
  const bool known = user != users->end();
  const bool right = is_password(password, known ? user->second.hash : nobodys_hash());
  if (!known || !right) {
    spdlog::warn("log-in from {} refused", call.request.peer);
    http::Response response;
    response.status = 401;
    response.body = dump({{"error", "user or password is wrong"}});
    response.delay = LogInGuard::kDelay;
    return response;
  }
  context.guard.right(name, call.request.network);
  spdlog::info("{} logged in from {}", name, call.request.peer);
  // What was there before ends: nobody's cookie grows into a session.
  if (const auto old = call.request.cookies.find(kCookie); old != call.request.cookies.end()) {
    context.sessions.end(old->second);
  }
  const std::string cookie = context.sessions.begin(name, user->second, now);
  const auto who = context.sessions.find(cookie, *users, now, true);
  http::Response response = json_response(session_json(context, who.value()));
  response.headers.emplace_back(
      "Set-Cookie", cookie_text(call.request, cookie,
                                static_cast<long>(context.settings.session_hours * 3600.0)));
  return response;
}

http::Response log_out(Context& context, const Call& call) {
  const auto cookie = call.request.cookies.find(kCookie);
  if (cookie != call.request.cookies.end()) context.sessions.end(cookie->second);
  http::Response response = json_response(json::object());
  response.headers.emplace_back("Set-Cookie", cookie_text(call.request, "", 0));
  return response;
}

}  // namespace loopwarden::page::api
