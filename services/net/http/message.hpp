// SPDX-License-Identifier: Apache-2.0
// Requests and answers for the handlers: plain data, without sockets and without Beast.
#pragma once

#include <chrono>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace loopwarden::http {

enum class Method { get, head, post, other };

struct Request {
  Method method = Method::get;
  std::vector<std::string> path;             // decoded; empty for "/"; no part is "", "." or ".."
  std::map<std::string, std::string> query;  // decoded; the last value if a key is repeated
  std::map<std::string, std::string> cookies;
  std::string body;
  std::string host;          // as sent, with the port
  std::string origin;        // empty: not sent
  std::string fetch_site;    // Sec-Fetch-Site; empty: not sent
  std::string csrf;          // X-CSRF-Token
  std::string content_type;  // in lower case, without parameters
  std::string if_none_match;
  bool accepts_gzip = false;
  bool person = false;  // X-Loopwarden-Person: 1: a key or a pointer moved within the last minute
  std::string peer;     // the client's address, without the port
  std::string network;  // key of the limits: the address, for IPv6 its /64
  bool peer_is_loopback = false;
  bool secure = false;  // received over TLS

  std::string_view part(std::size_t index) const noexcept {
    return index < path.size() ? std::string_view(path[index]) : std::string_view();
  }
};

// A body that is produced while it is sent.
class Source {
 public:
  virtual ~Source() = default;
  // Returns the next piece of some 10 kB; empty at the end. May block on the disk. One thread calls
  // it at a time.
  virtual std::string next() = 0;
};

struct Response {
  int status = 200;
  std::string content_type = "application/json";
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  std::shared_ptr<const std::string> shared;  // replaces `body`: shared by many clients
  std::unique_ptr<Source> source;             // replaces `body`: sent in chunks
  // Replaces the body by the stream of events, while this returns true. It is called every second
  // and by Server::look_at_streams().
  std::function<bool()> may_stay;
  // Makes the answer later: called in the request's pool after `delay`. It may return another
  // deferred answer. So a long wait holds no thread.
  std::function<Response()> next;
  std::chrono::milliseconds delay{0};  // delay of the answer; uses a timer, no thread

  std::string_view text() const noexcept { return shared ? *shared : body; }
};

// The pool that makes an answer. Each pool except `here` has its own threads and queue, so that
// slow work of one kind never delays another.
enum class Pool { here, daemon, disk, log_in, orders, fleet };
inline constexpr std::size_t kPools = 6;

// Answers the server's requests. Several threads of the pools call `answer` at a time.
class Handler {
 public:
  virtual ~Handler() = default;
  virtual Pool pool(const Request& request) const noexcept = 0;
  virtual Response answer(const Request& request) noexcept = 0;
};

}  // namespace loopwarden::http
