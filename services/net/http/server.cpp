// SPDX-License-Identifier: Apache-2.0
#include "services/net/http/server.hpp"

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/v6_only.hpp>
#include <boost/asio/signal_set.hpp>
#include <boost/asio/ssl.hpp>

#include <spdlog/spdlog.h>

#include <netdb.h>
#include <sys/socket.h>

#include <list>
#include <stdexcept>
#include <thread>

#include "services/net/http/connection.hpp"
#include "services/net/http/tls.hpp"

namespace loopwarden::http {
namespace {

using asio::ip::tcp;

Peer peer_of(const tcp::endpoint& endpoint) {
  asio::ip::address address = endpoint.address();
  if (address.is_v6() && address.to_v6().is_v4_mapped()) {
    address = asio::ip::make_address_v4(asio::ip::v4_mapped, address.to_v6());
  }
  Peer peer{.address = address.to_string(), .network = {}, .loopback = address.is_loopback()};
  // All of 127.0.0.0/8 and ::1 are addresses of this host.
  peer.network = peer.loopback ? "loopback" : peer.address;
  if (address.is_v6() && !peer.loopback) {
    auto bytes = address.to_v6().to_bytes();
    std::fill(bytes.begin() + 8, bytes.end(), static_cast<unsigned char>(0));
    peer.network = asio::ip::address_v6(bytes).to_string();
  }
  return peer;
}

sockaddr_storage name_of(int fd) {
  sockaddr_storage address{};
  socklen_t size = sizeof address;
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &size);
  return address;
}

}  // namespace

std::string address_of_socket(int fd) {
  const sockaddr_storage address = name_of(fd);
  if (address.ss_family != AF_INET && address.ss_family != AF_INET6) return {};
  std::array<char, INET6_ADDRSTRLEN> text{};
  ::getnameinfo(reinterpret_cast<const sockaddr*>(&address), sizeof address, text.data(),
                static_cast<socklen_t>(text.size()), nullptr, 0, NI_NUMERICHOST);
  return text.data();
}

class Server::Body {
 public:
  Body(ServerSettings settings, Handler& handler) : state_(settings, handler) {
    if (state_.settings.tls) load_certificate();
    every(state_.settings.timeouts.streams, [this] { state_.look_at_streams(); });
  }

  void load_certificate() {
    // Existing connections keep the old context alive (SSL_CTX is reference-counted).
    tls_ = std::make_shared<asio::ssl::context>(make_tls_context(*state_.settings.tls));
  }

  std::uint16_t listen(const std::string& address, std::uint16_t port) {
    const tcp::endpoint endpoint(asio::ip::make_address(address), port);
    tcp::acceptor acceptor(state_.loop);
    acceptor.open(endpoint.protocol());
    acceptor.set_option(asio::socket_base::reuse_address(true));
    if (endpoint.protocol() == tcp::v6()) acceptor.set_option(asio::ip::v6_only(true));
    acceptor.bind(endpoint);
    acceptor.listen(kBacklog);
    return keep(std::move(acceptor));
  }

  std::uint16_t adopt(int fd) {
    tcp::acceptor acceptor(state_.loop);
    acceptor.assign(name_of(fd).ss_family == AF_INET6 ? tcp::v6() : tcp::v4(), fd);
    return keep(std::move(acceptor));
  }

  void every(std::chrono::milliseconds interval, std::function<void()> work) {
    timers_.push_back(Timer{asio::steady_timer(state_.loop), interval, std::move(work), {}});
    tick(timers_.back());
  }

  void on_signal(int number, std::function<void()> work) {
    signals_.emplace_back(state_.loop, number, std::move(work));
    wait_for(signals_.back());
  }

  void run() {
    while (!serve()) {
    }
    state_.pools.stop();
    close_all();
  }

  ServerState& state() noexcept { return state_; }

 private:
  static constexpr int kBacklog = 128;

  // Tracks whether a wait is pending. Its callback holds the token. The token ends with the
  // callback.
  class Wait {
   public:
    bool is_on() const noexcept { return !token_.expired(); }
    std::shared_ptr<void> begin() {
      std::shared_ptr<void> token = std::make_shared<char>();
      token_ = token;
      return token;
    }

   private:
    std::weak_ptr<void> token_;
  };

  struct Listener {
    tcp::acceptor acceptor;
    asio::steady_timer pause;
    Wait wait;
  };
  struct Timer {
    asio::steady_timer timer;
    std::chrono::milliseconds interval;
    std::function<void()> work;
    Wait wait;
  };
  struct Signal {
    Signal(asio::io_context& loop, int number, std::function<void()> then)
        : signals(loop, number), work(std::move(then)) {}
    asio::signal_set signals;
    std::function<void()> work;
    Wait wait;
  };

  // Runs the loop. Returns false if a callback has thrown: lack of memory may end one connection,
  // but not the server.
  bool serve() {
    bool ready = false;
    try {
      take_up();
      ready = true;
      state_.loop.run();
      return true;
    } catch (const std::exception& e) {
      spdlog::error("server: {}", e.what());
      if (!ready) std::this_thread::sleep_for(std::chrono::milliseconds(10));
      return false;
    }
  }

  // Starts every wait that is not pending: at first all of them, later those whose callback has
  // thrown.
  void take_up() {
    for (Timer& timer : timers_) {
      if (!timer.wait.is_on()) tick(timer);
    }
    for (Signal& signal : signals_) {
      if (!signal.wait.is_on()) wait_for(signal);
    }
    for (Listener& listener : listeners_) {
      if (!listener.wait.is_on()) accept(listener);
    }
  }

  std::uint16_t keep(tcp::acceptor acceptor) {
    listeners_.push_back({std::move(acceptor), asio::steady_timer(state_.loop), {}});
    return listeners_.back().acceptor.local_endpoint().port();
  }

  static void tick(Timer& timer) {
    timer.timer.expires_after(timer.interval);
    timer.timer.async_wait([&timer, token = timer.wait.begin()](beast::error_code error) {
      if (error) return;
      timer.work();
      tick(timer);
    });
  }

  static void wait_for(Signal& signal) {
    signal.signals.async_wait([&signal, token = signal.wait.begin()](beast::error_code error, int) {
      if (error) return;
      signal.work();
      wait_for(signal);
    });
  }

  void accept(Listener& listener) {
    listener.acceptor.async_accept([this, &listener, token = listener.wait.begin()](
                                       beast::error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) return accept_later(listener);
      admit(std::move(socket));
      accept(listener);
    });
  }

  // Waits when no descriptors are left. Clients stay in the kernel's queue, and this loop does not
  // spin.
  void accept_later(Listener& listener) {
    listener.pause.expires_after(std::chrono::milliseconds(500));
    listener.pause.async_wait(
        [this, &listener, token = listener.wait.begin()](beast::error_code error) {
          if (!error) accept(listener);
        });
  }

  void admit(tcp::socket socket) {
    beast::error_code error;
    const tcp::endpoint endpoint = socket.remote_endpoint(error);
    if (error) return;
    Peer peer = peer_of(endpoint);
    const AdmissionControl::Admission admission =
        state_.admission.admit(peer.network, peer.loopback, std::chrono::steady_clock::now());
    state_.counters.displaced = state_.admission.displaced();
    state_.counters.turned_away = state_.admission.turned_away();
    if (admission.displaced) displace(*admission.displaced);
    if (admission.id == 0) return;
    socket.set_option(tcp::no_delay(true), error);
    ++state_.counters.accepted;
    try {
      open_connection(std::move(socket), std::move(peer), admission.id);
    } catch (...) {
      state_.admission.left(admission.id);
      throw;
    }
  }

  void open_connection(tcp::socket socket, Peer peer, std::uint64_t id) {
    if (tls_) {
      begin(std::make_shared<Connection<beast::ssl_stream<beast::tcp_stream>>>(
                state_, std::move(peer), id, std::move(socket), *tls_),
            id);
    } else {
      begin(std::make_shared<Connection<beast::tcp_stream>>(state_, std::move(peer), id,
                                                            std::move(socket)),
            id);
    }
  }

  template <class T>
  void begin(const std::shared_ptr<T>& client, std::uint64_t id) {
    state_.clients[id] = client;
    client->start();
  }

  void displace(std::uint64_t id) {
    const auto client = state_.clients.find(id);
    if (client == state_.clients.end()) return;
    if (const auto known = client->second.lock()) known->close();
  }

  void close_all() {
    const auto clients = state_.clients;
    for (const auto& [id, client] : clients) {
      if (const auto known = client.lock()) known->close();
    }
  }

  ServerState state_;
  std::shared_ptr<asio::ssl::context> tls_;
  std::list<Listener> listeners_;
  std::list<Timer> timers_;
  std::list<Signal> signals_;
};

Server::Server(ServerSettings settings, Handler& handler)
    : body_(std::make_unique<Body>(std::move(settings), handler)) {}

Server::~Server() = default;

std::uint16_t Server::listen(const std::string& address, std::uint16_t port) {
  try {
    return body_->listen(address, port);
  } catch (const std::exception& e) {
    throw std::runtime_error("can't listen at " + address + " port " + std::to_string(port) + ": " +
                             e.what());
  }
}

std::uint16_t Server::adopt(int listening_socket) { return body_->adopt(listening_socket); }

void Server::every(std::chrono::milliseconds interval, std::function<void()> work) {
  body_->every(interval, std::move(work));
}

void Server::on_signal(int number, std::function<void()> work) {
  body_->on_signal(number, std::move(work));
}

void Server::on_streams(std::function<void(std::size_t)> work) {
  body_->state().on_streams = std::move(work);
}

void Server::run() { body_->run(); }

void Server::stop() { body_->state().loop.stop(); }

void Server::publish(EventKind kind, std::string data) {
  ServerState& state = body_->state();
  asio::post(state.loop, [&state, kind, data = std::move(data)] {
    state.hub.publish(kind, data);
    state.for_streams([](Client& client) { client.news(); });
  });
}

void Server::look_at_streams() {
  ServerState& state = body_->state();
  asio::post(state.loop, [&state] { state.look_at_streams(); });
}

void Server::reload_certificate() {
  if (body_->state().settings.tls) body_->load_certificate();
}

Counters Server::counters() const {
  const LiveCounters& live = body_->state().counters;
  return {.connections = live.connections,
          .streams = live.streams,
          .accepted = live.accepted,
          .displaced = live.displaced,
          .turned_away = live.turned_away,
          .timed_out = live.timed_out,
          .refused = live.refused,
          .requests = live.requests,
          .bytes_sent = live.bytes_sent};
}

}  // namespace loopwarden::http
