// SPDX-License-Identifier: Apache-2.0
#include "services/page/api/gate.hpp"

#include "base/peer_list.hpp"
#include "services/page/users/password.hpp"

namespace loopwarden::page::api {
namespace {

// Returns the host name: box.plant for "box.plant:8480", ::1 for "[::1]:8480".
std::string host_name(const std::string& host) {
  if (host.starts_with('[')) {
    const std::size_t end = host.find(']');
    return end == std::string::npos ? std::string() : host.substr(1, end - 1);
  }
  return host.substr(0, host.find(':'));
}

}  // namespace

Identity identity_of(Context& context, const http::Request& request, Renews renews) {
  if (!context.users.has_file()) {
    return {.user = {},
            .role = request.peer_is_loopback ? Role::viewer : Role::none,
            .csrf = fingerprint("nobody")};
  }
  const auto cookie = request.cookies.find(kCookie);
  if (cookie != request.cookies.end()) {
    const bool touch =
        renews == Renews::by_person && (request.person || request.method == http::Method::post);
    const auto users = context.users.users();
    const auto found =
        context.sessions.find(cookie->second, *users, std::chrono::steady_clock::now(), touch);
    if (found) return *found;
  }
  return {.user = {}, .role = Role::none, .csrf = fingerprint("nobody")};
}

void check_host(const Context& context, const http::Request& request) {
  const std::string name = host_name(request.host);
  // An address can't be redirected by DNS.
  if (name == "localhost" || context.hosts.has(name) || base::parse_network(name)) return;
  throw ApiError(403, "this box has no name '" + name + "' that page.yaml knows (key hosts)");
}

void check_origin(const http::Request& request) {
  if (!request.fetch_site.empty() && request.fetch_site != "same-origin" &&
      request.fetch_site != "none") {
    throw ApiError(403, "another site's page asks");
  }
  const std::string own = (request.secure ? "https://" : "http://") + request.host;
  if (!request.origin.empty() && request.origin != own) {
    throw ApiError(403, "another site's page asks");
  }
}

void check_post(const http::Request& request, const Identity& who) {
  if (!same_secret(request.csrf, who.csrf)) {
    throw ApiError(403, "the token in X-CSRF-Token is not this session's; load the page again");
  }
  if (request.content_type != "application/json") throw ApiError(415, "a body is application/json");
}

void check_role(const Identity& who, Role needed) {
  if (who.role >= needed) return;
  if (who.role == Role::none) throw ApiError(401, "log in first");
  throw ApiError(403, "that takes the role " + std::string(to_text(needed)));
}

}  // namespace loopwarden::page::api
