// SPDX-License-Identifier: Apache-2.0
// Requests and answers as the handlers see them: plain data, without sockets and without Beast.
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
  std::vector<std::string> path;             // decoded; "/" is none, no part is "", "." or ".."
  std::map<std::string, std::string> query;  // decoded; of a key given twice the last one
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
  std::string network;  // what limits count: of an IPv6 address its /64
  bool peer_is_loopback = false;
  bool secure = false;  // it came over TLS

  std::string_view part(std::size_t index) const noexcept {
    return index < path.size() ? std::string_view(path[index]) : std::string_view();
  }
};

// A body that is made while it is sent.
class Source {
 public:
  virtual ~Source() = default;
  // The next piece, some ten kB; empty: that was all. May block on the disk; called by one thread at a time.
  virtual std::string next() = 0;
};

struct Response {
  int status = 200;
  std::string content_type = "application/json";
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  std::shared_ptr<const std::string> shared;  // in place of `body`: of many clients
  std::unique_ptr<Source> source;             // in place of `body`: sent in chunks
  // In place of a body: the stream of events, as long as this says so; asked every second and by Server::look_at_streams().
  std::function<bool()> may_stay;
  // In place of an answer: what makes it, asked in the request's pool after `delay`; may ask for another round. So a long wait
  // holds no thread.
  std::function<Response()> next;
  std::chrono::milliseconds delay{0};  // before the answer is sent; costs a timer, no thread

  std::string_view text() const noexcept { return shared ? *shared : body; }
};

// Where an answer is made. Each pool but `here` has threads and a queue of its own, so that slow work
// of one kind never delays another.
enum class Pool { here, daemon, disk, log_in, orders, fleet };
inline constexpr std::size_t kPools = 6;

// What stands behind the server. `answer` is called by the pool's threads, several at a time.
class Handler {
 public:
  virtual ~Handler() = default;
  virtual Pool pool(const Request& request) const noexcept = 0;
  virtual Response answer(const Request& request) noexcept = 0;
};

}  // namespace loopwarden::http
