// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "services/page/api/context.hpp"
#include "services/net/http/message.hpp"

namespace loopwarden::page::api {

// Finds a request's handler, rejects senders without the required role, and answers exceptions.
class Router final : public http::Handler {
 public:
  explicit Router(Context context) : context_(std::move(context)) {}

  http::Pool pool(const http::Request& request) const noexcept override;
  http::Response answer(const http::Request& request) noexcept override;

 private:
  http::Response route(const http::Request& request);

  Context context_;
};

}  // namespace loopwarden::page::api
