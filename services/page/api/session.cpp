// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <future>
#include <nlohmann/json.hpp>
#include <optional>

#include "services/page/api/body.hpp"
#include "services/page/api/gate.hpp"
#include "services/page/api/handlers.hpp"
#include "services/page/ldap/ldap_text.hpp"
#include "services/page/users/password.hpp"

namespace loopwarden::page::api {
namespace {

using nlohmann::json;

std::string host_of_this_box() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

// Returns the offset of the process's time zone, which main() sets from page.yaml.
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
          {"source", who.user.empty() ? json(nullptr) : json(who.directory ? "directory" : "file")},
          {"csrf", who.csrf},
          {"login", context.users.has_file()},
          {"must_login", who.role == Role::none},
          {"can",
           {{"alarms", acts && state && state->about.page.alarms},
            {"control", acts && state && state->about.page.control && context.settings.control},
            {"tuning", who.role == Role::engineer && context.settings.control && state &&
                           state->about.page.tuning},
            {"tests", who.role == Role::engineer && context.settings.control && state &&
                          state->about.page.tests},
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

// A log-in, from the request to its answer.
struct Attempt {
  Context* context;
  http::Request from;  // without its body, because that has the password
  std::string name;    // of the user, as the guard counts it
  Moment begun = std::chrono::steady_clock::now();
};

// With a directory, every refusal takes this long, whatever its reason and whoever checked it. So
// its time reveals neither names nor passwords, unless the directory itself takes longer.
constexpr std::chrono::milliseconds kAnswerOfDirectory{1000};
constexpr std::chrono::seconds kPatience{10};
constexpr std::chrono::milliseconds kLook{50};

http::Response refused(const Attempt& attempt, int status, const char* why) {
  http::Response response;
  response.status = status;
  response.body = dump({{"error", why}});
  response.delay = LogInGuard::kDelay;
  if (attempt.context->ldap != nullptr) {
    const auto taken = std::chrono::duration_cast<std::chrono::milliseconds>(
        std::chrono::steady_clock::now() - attempt.begun);
    response.delay += std::max(kAnswerOfDirectory - taken, std::chrono::milliseconds(0));
  }
  return response;
}

http::Response wrong(const Attempt& attempt) {
  return refused(attempt, 401, "user or password is wrong");
}

// Does not count as a try, but has the delay of a refusal, so an immediate new try gains no time.
http::Response not_judged(const Attempt& attempt, const char* why) {
  attempt.context->guard.not_judged(attempt.name, attempt.from.network, attempt.begun);
  return refused(attempt, 503, why);
}

http::Response admitted(const Attempt& attempt, const User& user) {
  Context& context = *attempt.context;
  const http::Request& request = attempt.from;
  context.guard.right(attempt.name, request.network);
  spdlog::info("{} logged in from {}{}", attempt.name, request.peer,
               user.directory ? " by the directory" : "");
  // Ends the earlier session, so that no cookie of before the log-in becomes a session (fixation).
  if (const auto old = request.cookies.find(kCookie); old != request.cookies.end()) {
    context.sessions.end(old->second);
  }
  const Moment now = std::chrono::steady_clock::now();
  const std::string cookie = context.sessions.begin(attempt.name, user, now);
  // The order matters: a directory's user is admitted only if he has a session.
  if (user.directory) context.users.admit(attempt.name, user.role, user.hash);
  const auto who = context.sessions.find(cookie, *context.users.users(), now, true);
  if (!who) throw ApiError(503, "the users have just changed; try again");
  http::Response response = json_response(session_json(context, *who));
  response.headers.emplace_back(
      "Set-Cookie",
      cookie_text(request, cookie, static_cast<long>(context.settings.session_hours * 3600.0)));
  return response;
}

http::Response by_directory(const Attempt& attempt,
                            const std::shared_future<ldap::Outcome>& answer) {
  using End = ldap::Outcome::End;
  if (answer.wait_for(std::chrono::seconds(0)) != std::future_status::ready) {
    if (std::chrono::steady_clock::now() - attempt.begun > kPatience) {
      return not_judged(attempt, "the directory does not answer");
    }
    http::Response later;
    later.delay = kLook;
    later.next = [attempt, answer] { return by_directory(attempt, answer); };
    return later;
  }
  const ldap::Outcome& outcome = answer.get();
  if (outcome.end == End::admitted) {
    return admitted(attempt, {outcome.role, outcome.dn, false, true});
  }
  spdlog::warn("log-in from {} refused by the directory: {}", attempt.from.peer, outcome.why);
  switch (outcome.end) {
    case End::unavailable:
      return not_judged(attempt, "the directory can't be asked; the page's log has the reason");
    case End::no_group:
      return refused(attempt, 403,
                     "the directory knows you, but no group of yours gives a role here");
    default: return wrong(attempt);
  }
}

http::Request without_body(http::Request request) {
  request.body.clear();
  return request;
}

// Returns the name in the directory; nullopt if the directory is not asked about this user.
std::optional<std::string> name_in_directory(const Context& context, const std::string& typed) {
  if (context.ldap == nullptr) return std::nullopt;
  std::optional<std::string> name = ldap::account_name(typed, context.settings.ldap->domains);
  if (name && context.users.is_in_file(*name)) return std::nullopt;
  return name;
}

}  // namespace

http::Response session(Context& context, const Call& call) {
  check_query(call.request, {});
  return json_response(session_json(context, call.who));
}

http::Response log_in(Context& context, const Call& call) {
  if (!context.users.has_file()) throw ApiError(403, "this page has no users");
  const json body = object_of(call.request, {"user", "password"});
  const std::string typed = text_at(body, "user", 128);
  const std::string password = text_at(body, "password", kLongestPassword);
  const std::optional<std::string> in_directory = name_in_directory(context, typed);
  const Attempt attempt{.context = &context,
                        .from = without_body(call.request),
                        .name = in_directory.value_or(typed)};
  if (const unsigned wait_s =
          context.guard.wait_s(attempt.name, call.request.network, attempt.begun)) {
    return too_often(wait_s);
  }
  if (in_directory && !password.empty()) {
    const auto answer = context.ldap->begin(*in_directory, password, call.request.network,
                                            attempt.begun + kPatience);
    if (!answer.valid()) {
      return not_judged(attempt, "too many log-ins wait for the directory; try again");
    }
    return by_directory(attempt, answer);
  }
  const auto users = context.users.users();
  const auto user = users->find(typed);
  const bool known = user != users->end() && !user->second.directory;
  const bool right = is_password(password, known ? user->second.hash : nobodys_hash());
  if (known && right) return admitted(attempt, user->second);
  spdlog::warn("log-in from {} refused", call.request.peer);
  return wrong(attempt);
}

http::Response log_out(Context& context, const Call& call) {
  const auto cookie = call.request.cookies.find(kCookie);
  if (cookie != call.request.cookies.end()) context.sessions.end(cookie->second);
  http::Response response = json_response(json::object());
  response.headers.emplace_back("Set-Cookie", cookie_text(call.request, "", 0));
  return response;
}

}  // namespace loopwarden::page::api
