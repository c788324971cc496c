// SPDX-License-Identifier: Apache-2.0
// Checks that a request must pass before a handler gets it.
#pragma once

#include "services/page/api/context.hpp"

namespace loopwarden::page::api {

inline constexpr const char* kCookie = "lw_session";

// Whether a request keeps its session from ending as idle. Requests of a person do (a POST, or
// X-Loopwarden-Person). Automatic requests of the page and open streams don't.
enum class Renews { by_person, never };

// Returns the sender of the request. Without a users file, every client on this host is a viewer.
Identity identity_of(Context& context, const http::Request& request,
                     Renews renews = Renews::by_person);

// Checks that the browser addresses one of this box's names, so that a foreign name can't lead here
// (DNS rebinding). Throws ApiError 403.
void check_host(const Context& context, const http::Request& request);

// Throws ApiError 403 if Sec-Fetch-Site or Origin, as far as they are sent, show that a page of
// another origin made the request.
void check_origin(const http::Request& request);

// Checks that a POST has the session's token and a JSON body. Throws ApiError 403 or 415.
void check_post(const http::Request& request, const Identity& who);

// Checks that the sender has at least this role. Throws ApiError 401 or 403.
void check_role(const Identity& who, Role needed);

}  // namespace loopwarden::page::api
