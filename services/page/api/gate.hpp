// SPDX-License-Identifier: Apache-2.0
// What a request must pass before a handler sees it.
#pragma once

#include "services/page/api/context.hpp"

namespace loopwarden::page::api {

inline constexpr const char* kCookie = "lw_session";

// Whether a request keeps its session from ending as idle: one that a person makes (a POST, or X-Loopwarden-Person) does, what the
// page asks by itself does not, nor does a stream that is looked at.
enum class Renews { by_person, never };

// Who asks. Without a users file everybody on this host is a viewer.
Identity identity_of(Context& context, const http::Request& request,
                     Renews renews = Renews::by_person);

// The host that the browser thinks it talks to is one of ours, so that no name of a stranger's leads here (DNS
// rebinding). Throws ApiError 403.
void check_host(const Context& context, const http::Request& request);

// Throws ApiError 403 if Sec-Fetch-Site or Origin, as far as they are sent, show that another origin's page made the browser ask.
void check_origin(const http::Request& request);

// A POST has the session's token and a JSON body. Throws ApiError 403 or 415.
void check_post(const http::Request& request, const Identity& who);

// Throws ApiError 401 or 403.
void check_role(const Identity& who, Role needed);

}  // namespace loopwarden::page::api
