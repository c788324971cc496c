// SPDX-License-Identifier: Apache-2.0
// One client's connection: handshake, head, body, answer, next head. All steps are callbacks on the
// server's event loop. Only server.cpp includes this file, because it includes Beast.
//
// It uses callbacks, not coroutines: clang 14 of Debian 12, which the sanitizer builds use, has no
// coroutines that Asio 1.74 supports.
#pragma once

#include <boost/asio/post.hpp>
#include <boost/asio/ssl/context.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/write.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/core/tcp_stream.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/read.hpp>
#include <boost/beast/http/string_body.hpp>
#include <boost/beast/ssl/ssl_stream.hpp>

#include <spdlog/spdlog.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "services/net/http/admission_control.hpp"
#include "services/net/http/event_hub.hpp"
#include "services/net/http/worker_pools.hpp"
#include "services/net/http/message.hpp"
#include "services/net/http/packing.hpp"
#include "services/net/http/request_head.hpp"
#include "services/net/http/response_head.hpp"
#include "services/net/http/server.hpp"

namespace loopwarden::http {

namespace asio = boost::asio;
namespace beast = boost::beast;

struct LiveCounters {
  std::atomic<std::uint64_t> connections{0}, streams{0}, accepted{0}, displaced{0}, turned_away{0},
      timed_out{0}, refused{0}, requests{0}, bytes_sent{0};
};

class Client {
 public:
  virtual ~Client() = default;
  virtual void close() noexcept = 0;
  virtual void news() noexcept = 0;  // the hub has changed
  virtual void look() noexcept = 0;  // checks whether its stream may stay
};

// Data that all connections share. Only the loop's thread may use it, except pools and counters.
struct ServerState {
  ServerState(const ServerSettings& all, Handler& behind)
      : settings(all), handler(behind), admission(all.limits), pools(all.pools) {}

  void streams_changed() const {
    if (on_streams) on_streams(streams.size());
  }

  template <class Act>
  void for_streams(Act act) const {
    const std::set<Client*> all = streams;
    for (Client* client : all) {
      // act() may close other streams, which then remove themselves.
      if (streams.contains(client)) act(*client);
    }
  }
  void look_at_streams() const {
    for_streams([](Client& client) { client.look(); });
  }

  ServerSettings settings;
  Handler& handler;
  asio::io_context loop{1};
  AdmissionControl admission;
  EventHub hub;
  LiveCounters counters;
  std::map<std::uint64_t, std::weak_ptr<Client>> clients;
  std::set<Client*> streams;
  std::function<void(std::size_t)> on_streams;
  WorkerPools pools;  // destroyed first: its threads post to the loop
};

struct Peer {
  std::string address;  // as in the journal
  std::string network;  // key of the limits; for an IPv6 client its /64
  bool loopback = false;
};

template <class Stream>
class Connection final : public Client, public std::enable_shared_from_this<Connection<Stream>> {
 public:
  static constexpr bool kSecure = !std::is_same_v<Stream, beast::tcp_stream>;

  template <class... Arguments>
  Connection(ServerState& state, Peer peer, std::uint64_t id, Arguments&&... stream)
      : state_(state),
        peer_(std::move(peer)),
        id_(id),
        stream_(std::forward<Arguments>(stream)...),
        timer_(state.loop) {
    ++state_.counters.connections;
  }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() override { close(); }

  void start() {
    if constexpr (kSecure) {
      tcp().expires_after(state_.settings.timeouts.handshake);
      stream_.async_handshake(asio::ssl::stream_base::server, mine([this](beast::error_code error) {
                                error ? give_up(error) : read_head();
                              }));
    } else {
      read_head();
    }
  }

  void close() noexcept override {
    if (closed_) return;
    closed_ = true;
    try {
      beast::error_code ignored;
      timer_.cancel();
      tcp().socket().close(ignored);
      if (state_.streams.erase(this) > 0) {
        --state_.counters.streams;
        state_.streams_changed();
      }
      state_.admission.left(id_);
      state_.clients.erase(id_);
      --state_.counters.connections;
    } catch (const std::exception&) {
      // Every step is done at most once, and the destructor closes the socket.
    }
  }

  void news() noexcept override {
    mine([this] {
      if (!closed_ && !writing_) pump();
    })();
  }

  void look() noexcept override {
    mine([this] {
      if (closed_ || ending_ || response_.may_stay()) return;
      ending_ = true;
      if (!writing_) pump();
    })();
  }

 private:
  using Parser = beast::http::request_parser<beast::http::string_body>;
  using Clock = std::chrono::steady_clock;
  static constexpr std::uint32_t kMostHeadBytes = 16UL * 1024UL;
  static constexpr std::chrono::milliseconds kPoolIsFull{100};

  // Wraps a callback of the loop. An exception ends this connection only.
  template <class Act>
  auto mine(Act act) {
    return mine_moved(this->shared_from_this(), std::move(act));
  }
  // The same, with an owner of the connection passed in.
  template <class Act>
  static auto mine_moved(std::shared_ptr<Connection> held, Act act) {
    return [self = std::move(held), act = std::move(act)](auto... arguments) mutable {
      try {
        act(arguments...);
      } catch (const std::exception& e) {
        spdlog::error("connection: {}", e.what());
        self->close();
      }
    };
  }

  beast::tcp_stream& tcp() noexcept { return beast::get_lowest_layer(stream_); }

  void give_up(const beast::error_code& error) {
    if (error == beast::error::timeout) ++state_.counters.timed_out;
    close();
  }

  void read_head() {
    parser_.emplace();
    parser_->header_limit(kMostHeadBytes);
    parser_->body_limit(kMostBodyBytes);
    tcp().expires_after(served_ ? state_.settings.timeouts.next : state_.settings.timeouts.header);
    beast::http::async_read_header(
        stream_, buffer_, *parser_,
        mine([this](beast::error_code error, std::size_t) { on_head(error); }));
  }

  void on_head(const beast::error_code& error) {
    using Code = beast::http::error;
    if (error == Code::header_limit) return refuse({431, "the head is too large"});
    if (error == Code::body_limit) return refuse({413, "a body has at most 64 KiB"});
    if (error == Code::end_of_stream || error == Code::partial_message) return close();
    if (error && error.category() == beast::http::make_error_code(Code::bad_method).category()) {
      return refuse({400, "the request is not HTTP"});
    }
    if (error) return give_up(error);
    take_head();
    if (parser_->get().version() != 11) return refuse({505, "only HTTP/1.1 is supported"});
    if (const auto refusal = refusal_of(head_)) return refuse(*refusal);
    if (const unsigned wait = state_.admission.retry_after_s(peer_.network, Clock::now())) {
      return refuse({429, "too many requests"}, wait);
    }
    parser_->is_done() ? on_request() : read_body();
  }

  void take_head() {
    head_.method = std::string(parser_->get().method_string());
    head_.target = std::string(parser_->get().target());
    head_.fields.clear();
    for (const auto& field : parser_->get()) {
      head_.fields.emplace_back(std::string(field.name_string()), std::string(field.value()));
    }
  }

  void read_body() {
    tcp().expires_after(state_.settings.timeouts.body);
    beast::http::async_read(stream_, buffer_, *parser_,
                            mine([this](beast::error_code error, std::size_t) {
                              error ? give_up(error) : on_request();
                            }));
  }

  void on_request() {
    served_ = true;
    ++state_.counters.requests;
    state_.admission.busy(id_);
    keep_alive_ = parser_->keep_alive();
    request_ = request_of(head_);
    request_.body = std::move(parser_->get().body());
    request_.peer = peer_.address;
    request_.network = peer_.network;
    request_.peer_is_loopback = peer_.loopback;
    request_.secure = kSecure;
    is_head_ = request_.method == Method::head;
    pool_ = state_.handler.pool(request_);
    if (pool_ == Pool::here) return respond(state_.handler.answer(request_));
    if (!in_pool([this] { return state_.handler.answer(request_); })) respond(busy_response());
  }

  // Makes a response on a thread of the pool. Returns false if the pool's queue is full.
  template <class Make>
  bool in_pool(Make make) {
    // Allocated in advance, so that a thread can answer when memory runs out.
    auto answer = std::make_shared<Response>(error_response(500, "the page could not answer"));
    return state_.pools.begin(
        pool_, peer_.network,
        [self = this->shared_from_this(), make, answer = std::move(answer)]() mutable noexcept {
          try {
            Response made = make();
            pack(made, self->request_);
            *answer = std::move(made);
          } catch (const std::exception& e) {
            spdlog::error("answer: {}", e.what());
          }
          // Moves the owner, so that the connection is destroyed on the loop's thread.
          asio::io_context& loop = self->state_.loop;
          Connection* connection = self.get();
          asio::post(loop, connection->mine_moved(std::move(self), [connection, answer]() mutable {
            connection->respond(std::move(*answer));
          }));
        });
  }

  static Response busy_response() {
    Response response = error_response(503, "the server is busy; try again");
    response.headers.emplace_back("Retry-After", "1");
    return response;
  }

  // Answers with an error and closes the connection, because the start of the next request is
  // unknown.
  void refuse(const Refusal& refusal, unsigned retry_after_s = 0) {
    ++state_.counters.refused;
    keep_alive_ = false;
    is_head_ = false;
    Response response = error_response(refusal.status, refusal.why);
    if (retry_after_s > 0) {
      response.headers.emplace_back("Retry-After", std::to_string(retry_after_s));
    }
    respond(std::move(response));
  }

  void respond(Response response) {
    if (closed_) return;
    response_ = std::move(response);
    if (response_.next) return after(response_.delay, &Connection::ask_again);
    if (response_.delay.count() == 0) return send();
    after(response_.delay, &Connection::send);
  }

  void after(std::chrono::milliseconds delay, void (Connection::*then)()) {
    timer_.expires_after(delay);
    timer_.async_wait(mine([this, then](beast::error_code error) {
      if (!error && !closed_) (this->*then)();
    }));
  }

  // Makes the next response. Retries later if the pool is full.
  void ask_again() {
    if (!in_pool([this] { return response_.next(); })) after(kPoolIsFull, &Connection::ask_again);
  }

  void send() {
    if (closed_) return;
    if (response_.may_stay && (is_head_ || !state_.admission.stream(id_))) {
      response_.may_stay = nullptr;
      if (!is_head_) response_ = busy_response();
    }
    // A stream has no length. The close of the connection ends it.
    if (response_.may_stay) keep_alive_ = false;
    if (!response_.may_stay) state_.admission.idle(id_, Clock::now());
    out_ =
        head_text(response_, {.secure = kSecure, .keep_alive = keep_alive_, .is_head = is_head_});
    const std::string_view body = is_head_ ? std::string_view() : response_.text();
    write({asio::buffer(out_), asio::buffer(body.data(), body.size())}, &Connection::on_sent);
  }

  void write(std::vector<asio::const_buffer> buffers, void (Connection::*then)()) {
    writing_ = true;
    to_write_ = std::move(buffers);
    then_ = then;
    write_step();
  }

  // Writes the next 64 KiB. Each step has its own time-out: a slow reader gets the whole answer,
  // and a client that stops reading is closed.
  void write_step() {
    constexpr std::size_t kStepBytes = 64UL * 1024UL;
    std::vector<asio::const_buffer> step;
    for (std::size_t room = kStepBytes; room > 0 && !to_write_.empty();) {
      asio::const_buffer& first = to_write_.front();
      step.push_back(asio::buffer(first, room));
      room -= step.back().size();
      first += step.back().size();
      if (first.size() == 0) to_write_.erase(to_write_.begin());
    }
    tcp().expires_after(state_.settings.timeouts.write);
    asio::async_write(stream_, step, mine([this](beast::error_code error, std::size_t n) {
                        state_.counters.bytes_sent += n;
                        error ? give_up(error) : on_step_written();
                      }));
  }

  void on_step_written() {
    if (closed_) return;
    if (!to_write_.empty()) return write_step();
    writing_ = false;
    (this->*then_)();
  }

  void on_sent() {
    if (closed_) return;
    if (response_.may_stay) return begin_stream();
    if (response_.source && !is_head_) return next_chunk();
    finish();
  }

  void finish() {
    response_ = Response();
    state_.admission.idle(id_, Clock::now());
    keep_alive_ ? read_head() : linger();
  }

  // --- body that is produced while it is sent ---

  void next_chunk() {
    if (closed_) return;
    auto piece = std::make_shared<std::string>();
    auto make = [self = this->shared_from_this(), piece = std::move(piece)]() mutable noexcept {
      bool failed = false;
      try {
        *piece = self->response_.source->next();
      } catch (const std::exception&) {
        failed = true;  // the client detects that the last chunk is missing
      }
      asio::io_context& loop = self->state_.loop;
      Connection* connection = self.get();
      asio::post(loop, connection->mine_moved(std::move(self), [connection, piece, failed] {
        failed ? connection->close() : connection->send_chunk(std::move(*piece));
      }));
    };
    if (!state_.pools.begin(Pool::disk, peer_.network, std::move(make))) {
      after(kPoolIsFull, &Connection::next_chunk);
    }
  }

  void send_chunk(std::string piece) {
    if (closed_) return;
    last_chunk_ = piece.empty();
    std::array<char, 24> size{};
    std::snprintf(size.data(), size.size(), "%zx\r\n", piece.size());
    out_ = size.data() + std::move(piece) + "\r\n";
    write({asio::buffer(out_)}, &Connection::on_chunk_sent);
  }

  void on_chunk_sent() {
    if (closed_) return;
    last_chunk_ ? finish() : next_chunk();
  }

  // --- the stream of events ---

  void begin_stream() {
    cursor_ = state_.hub.newcomer();
    state_.streams.insert(this);
    ++state_.counters.streams;
    state_.streams_changed();
    watch_for_end();
    beat();
    if (!writing_) pump();
  }

  // Reads and discards data of a listening client, to detect that it closes the connection.
  void watch_for_end() {
    tcp().expires_never();
    stream_.async_read_some(asio::buffer(scratch_),
                            mine([this](beast::error_code, std::size_t) { close(); }));
  }

  void beat() { after(state_.settings.timeouts.heartbeat, &Connection::on_beat); }

  void on_beat() {
    if (!writing_) {
      out_ = ":\n\n";
      write({asio::buffer(out_)}, &Connection::pump);
    }
    beat();
  }

  void pump() {
    if (closed_) return;
    if (ending_) return write({asio::buffer(kEndOfStream)}, &Connection::close);
    frames_ = state_.hub.news(cursor_);
    if (frames_.empty()) return;
    std::vector<asio::const_buffer> buffers;
    for (const Frame& frame : frames_) buffers.push_back(asio::buffer(*frame));
    write(buffers, &Connection::pump);
  }

  // --- the end ---

  // Reads the client's remaining data for a moment. Closing with unread bytes would discard the
  // answer.
  void linger() {
    beast::error_code ignored;
    tcp().socket().shutdown(asio::socket_base::shutdown_send, ignored);
    lingers_until_ = Clock::now() + state_.settings.timeouts.body;
    drain();
  }

  void drain() {
    constexpr std::size_t kMostDrained = 16UL * 1024UL * 1024UL;
    const auto now = Clock::now();
    if (drained_ > kMostDrained || now >= lingers_until_) return close();
    tcp().expires_at(std::min(now + state_.settings.timeouts.linger, lingers_until_));
    tcp().async_read_some(asio::buffer(scratch_),
                          mine([this](beast::error_code error, std::size_t n) {
                            drained_ += n;
                            error ? close() : drain();
                          }));
  }

  ServerState& state_;
  Peer peer_;
  std::uint64_t id_;
  Stream stream_;
  asio::steady_timer timer_;
  beast::flat_buffer buffer_{kMostHeadBytes + kMostBodyBytes};
  std::optional<Parser> parser_;
  RequestHead head_;
  Request request_;
  Pool pool_ = Pool::here;
  Response response_;
  std::string out_;
  std::array<char, 4096> scratch_{};
  EventHub::Cursor cursor_;
  std::vector<Frame> frames_;
  std::vector<asio::const_buffer> to_write_;
  void (Connection::*then_)() = nullptr;
  Clock::time_point lingers_until_;
  std::size_t drained_ = 0;
  bool served_ = false;
  bool keep_alive_ = true;
  bool is_head_ = false;
  bool writing_ = false;
  bool last_chunk_ = false;
  bool ending_ = false;  // the stream's reader may not stay
  bool closed_ = false;
};

}  // namespace loopwarden::http
