// SPDX-License-Identifier: Apache-2.0
// One client's connection, in callbacks on the server's loop: handshake, head, body, answer, next head. Included by
// server.cpp alone, since it brings Beast.
//
// Callbacks and no coroutines: clang 14 of Debian 12, which builds what the sanitizers watch, has none that Asio 1.74 takes.
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

#include "page/http/doorkeeper.hpp"
#include "page/http/event_board.hpp"
#include "page/http/lanes.hpp"
#include "page/http/message.hpp"
#include "page/http/packing.hpp"
#include "page/http/request_head.hpp"
#include "page/http/response_head.hpp"
#include "page/http/server.hpp"

namespace loopwarden::page::http {

namespace asio = boost::asio;
namespace beast = boost::beast;

struct LiveCounters {
  std::atomic<std::uint64_t> connections{0}, streams{0}, accepted{0}, displaced{0}, turned_away{0},
      timed_out{0}, refused{0}, requests{0}, bytes_sent{0};
};

class Guest {
 public:
  virtual ~Guest() = default;
  virtual void close() noexcept = 0;
  virtual void news() = 0;  // the board has changed
};

// What all connections share; all of it but lanes and counters belongs to the loop's thread.
struct House {
  House(const ServerSettings& all, Handler& behind)
      : settings(all), handler(behind), door(all.door), lanes(all.lanes) {}

  void streams_changed() const {
    if (on_streams) on_streams(streams.size());
  }

  ServerSettings settings;
  Handler& handler;
  asio::io_context loop{1};
  Doorkeeper door;
  EventBoard board;
  LiveCounters counters;
  std::map<std::uint64_t, std::weak_ptr<Guest>> guests;
  std::set<Guest*> streams;
  std::function<void(std::size_t)> on_streams;
  Lanes lanes;  // goes first: its threads post to the loop
};

struct Peer {
  std::string address;  // as the journal has it
  std::string network;  // what limits count: an IPv6 client has a whole /64 to itself
  bool loopback = false;
};

template <class Stream>
class Connection final : public Guest, public std::enable_shared_from_this<Connection<Stream>> {
 public:
  static constexpr bool kSecure = !std::is_same_v<Stream, beast::tcp_stream>;

  template <class... Arguments>
  Connection(House& house, Peer peer, std::uint64_t id, Arguments&&... stream)
      : house_(house),
        peer_(std::move(peer)),
        id_(id),
        stream_(std::forward<Arguments>(stream)...),
        timer_(house.loop) {}
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;
  ~Connection() override { close(); }

  void start() {
    if constexpr (kSecure) {
      tcp().expires_after(house_.settings.timeouts.handshake);
      stream_.async_handshake(asio::ssl::stream_base::server,
                              [self = this->shared_from_this()](beast::error_code error) {
                                error ? self->give_up(error) : self->read_head();
                              });
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
      if (house_.streams.erase(this) > 0) {
        --house_.counters.streams;
        house_.streams_changed();
      }
      house_.door.left(id_);
      house_.guests.erase(id_);
      --house_.counters.connections;
    } catch (const std::exception&) {
      // Nothing of it can be done twice, and the socket closes with this object.
    }
  }

  void news() override {
    if (!closed_ && !writing_) pump();
  }

 private:
  using Parser = beast::http::request_parser<beast::http::string_body>;
  static constexpr std::uint32_t kMostHeadBytes = 16UL * 1024UL;

  beast::tcp_stream& tcp() noexcept { return beast::get_lowest_layer(stream_); }

  void give_up(const beast::error_code& error) {
    if (error == beast::error::timeout) ++house_.counters.timed_out;
    close();
  }

  void read_head() {
    parser_.emplace();
    parser_->header_limit(kMostHeadBytes);
    parser_->body_limit(kMostBodyBytes);
    tcp().expires_after(served_ ? house_.settings.timeouts.next : house_.settings.timeouts.header);
    beast::http::async_read_header(
        stream_, buffer_, *parser_,
        [self = this->shared_from_this()](beast::error_code error, std::size_t) {
          self->on_head(error);
        });
  }

  void on_head(const beast::error_code& error) {
    using Code = beast::http::error;
    if (error == Code::header_limit) return refuse({431, "the head is too large"});
    if (error == Code::body_limit) return refuse({413, "a body has at most 64 KiB"});
    if (error == Code::end_of_stream || error == Code::partial_message) return close();
    if (error && error.category() == beast::http::make_error_code(Code::bad_method).category()) {
      return refuse({400, "that is no HTTP"});
    }
    if (error) return give_up(error);
    take_head();
    if (parser_->get().version() != 11) return refuse({505, "HTTP/1.1 is spoken here"});
    if (const auto refusal = refusal_of(head_)) return refuse(*refusal);
    if (const unsigned wait = house_.door.wait_s(peer_.network, Clock::now())) {
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
    tcp().expires_after(house_.settings.timeouts.body);
    beast::http::async_read(
        stream_, buffer_, *parser_,
        [self = this->shared_from_this()](beast::error_code error, std::size_t) {
          error ? self->give_up(error) : self->on_request();
        });
  }

  void on_request() {
    served_ = true;
    ++house_.counters.requests;
    house_.door.busy(id_);
    keep_alive_ = parser_->keep_alive();
    Request request = request_of(head_);
    request.body = std::move(parser_->get().body());
    request.peer = peer_.address;
    request.peer_is_loopback = peer_.loopback;
    request.secure = kSecure;
    is_head_ = request.method == Method::head;
    const Lane lane = house_.handler.lane(request);
    if (lane == Lane::here) return respond(house_.handler.answer(request));
    const bool begun = house_.lanes.begin(
        lane, peer_.network,
        [self = this->shared_from_this(), request = std::move(request)]() mutable {
          auto answer = std::make_shared<Response>(self->house_.handler.answer(request));
          pack(*answer, request);
          // Moved: the last word on the connection is the loop's.
          asio::io_context& loop = self->house_.loop;
          asio::post(loop, [self = std::move(self), answer] { self->respond(std::move(*answer)); });
        });
    if (!begun) respond(busy_response());
  }

  static Response busy_response() {
    Response response = error_response(503, "too much to do; try again");
    response.headers.emplace_back("Retry-After", "1");
    return response;
  }

  // The connection ends with it: nobody knows where the next request would begin.
  void refuse(const Refusal& refusal, unsigned retry_after_s = 0) {
    ++house_.counters.refused;
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
    if (response_.delay.count() == 0) return send();
    timer_.expires_after(response_.delay);
    timer_.async_wait([self = this->shared_from_this()](beast::error_code error) {
      if (!error) self->send();
    });
  }

  void send() {
    if (closed_) return;
    if (response_.may_stay && (is_head_ || !has_room_for_stream())) {
      response_.may_stay = nullptr;
      if (!is_head_) response_ = busy_response();
    }
    // A stream has no length: its end is the connection's.
    if (response_.may_stay) keep_alive_ = false;
    if (!response_.may_stay) house_.door.idle(id_, Clock::now());
    out_ =
        head_text(response_, {.secure = kSecure, .keep_alive = keep_alive_, .is_head = is_head_});
    const std::string_view body = is_head_ ? std::string_view() : response_.text();
    write({asio::buffer(out_), asio::buffer(body.data(), body.size())}, &Connection::on_sent);
  }

  // Some places are always left for who only asks.
  bool has_room_for_stream() const {
    return house_.streams.size() < std::max<std::size_t>(1, house_.settings.door.clients * 3 / 4);
  }

  void write(std::vector<asio::const_buffer> buffers, void (Connection::*then)()) {
    writing_ = true;
    to_write_ = std::move(buffers);
    then_ = then;
    write_step();
  }

  // Each step has the time-out to itself: who reads slowly gets all of it in the end, who does not read is soon gone.
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
    tcp().expires_after(house_.settings.timeouts.write);
    asio::async_write(stream_, step,
                      [self = this->shared_from_this()](beast::error_code error, std::size_t n) {
                        self->house_.counters.bytes_sent += n;
                        error ? self->give_up(error) : self->on_step_written();
                      });
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
    house_.door.idle(id_, Clock::now());
    keep_alive_ ? read_head() : linger();
  }

  // --- a body that is made while it is sent ---

  void next_chunk() {
    const auto make = [self = this->shared_from_this()]() mutable {
      auto piece = std::make_shared<std::string>();
      bool failed = false;
      try {
        *piece = self->response_.source->next();
      } catch (const std::exception&) {
        failed = true;  // the client sees that the last chunk is missing
      }
      asio::io_context& loop = self->house_.loop;
      asio::post(loop, [self = std::move(self), piece, failed] {
        failed ? self->close() : self->send_chunk(std::move(*piece));
      });
    };
    if (closed_ || house_.lanes.begin(Lane::disk, peer_.network, make)) return;
    timer_.expires_after(std::chrono::milliseconds(100));
    timer_.async_wait([self = this->shared_from_this()](beast::error_code error) {
      if (!error) self->next_chunk();
    });
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
    cursor_ = house_.board.newcomer();
    house_.streams.insert(this);
    ++house_.counters.streams;
    house_.streams_changed();
    watch_for_end();
    beat();
    if (!writing_) pump();
  }

  // What a client says while it listens is no request; that it has gone is seen here.
  void watch_for_end() {
    tcp().expires_never();
    stream_.async_read_some(
        asio::buffer(scratch_),
        [self = this->shared_from_this()](beast::error_code, std::size_t) { self->close(); });
  }

  void beat() {
    timer_.expires_after(house_.settings.timeouts.heartbeat);
    timer_.async_wait([self = this->shared_from_this()](beast::error_code error) {
      if (error || self->closed_) return;
      if (!self->response_.may_stay()) return self->close();
      if (!self->writing_) {
        self->out_ = ":\n\n";
        self->write({asio::buffer(self->out_)}, &Connection::pump);
      }
      self->beat();
    });
  }

  void pump() {
    if (closed_) return;
    frames_ = house_.board.news(cursor_);
    if (frames_.empty()) return;
    std::vector<asio::const_buffer> buffers;
    for (const Frame& frame : frames_) buffers.push_back(asio::buffer(*frame));
    write(buffers, &Connection::pump);
  }

  // --- the end ---

  // What the client still sends is read for a moment: a close with unread bytes would take the answer from it.
  void linger() {
    beast::error_code ignored;
    tcp().socket().shutdown(asio::socket_base::shutdown_send, ignored);
    tcp().expires_after(std::chrono::seconds(2));
    drain();
  }

  void drain() {
    tcp().async_read_some(asio::buffer(scratch_), [self = this->shared_from_this()](
                                                      beast::error_code error, std::size_t n) {
      self->drained_ += n;
      constexpr std::size_t kMostDrained = 4UL * 1024UL * 1024UL;
      error || self->drained_ > kMostDrained ? self->close() : self->drain();
    });
  }

  using Clock = std::chrono::steady_clock;

  House& house_;
  Peer peer_;
  std::uint64_t id_;
  Stream stream_;
  asio::steady_timer timer_;
  beast::flat_buffer buffer_{kMostHeadBytes + kMostBodyBytes};
  std::optional<Parser> parser_;
  RequestHead head_;
  Response response_;
  std::string out_;
  std::array<char, 4096> scratch_{};
  EventBoard::Cursor cursor_;
  std::vector<Frame> frames_;
  std::vector<asio::const_buffer> to_write_;
  void (Connection::*then_)() = nullptr;
  std::size_t drained_ = 0;
  bool served_ = false;
  bool keep_alive_ = true;
  bool is_head_ = false;
  bool writing_ = false;
  bool last_chunk_ = false;
  bool closed_ = false;
};

}  // namespace loopwarden::page::http
