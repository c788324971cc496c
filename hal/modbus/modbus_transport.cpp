// SPDX-License-Identifier: Apache-2.0
#include "hal/modbus/modbus_transport.hpp"

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/select.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "hal/modbus/rtu_frame.hpp"

namespace loopwarden::hal::modbus {
namespace {

constexpr std::int64_t kNanosecondsPerMillisecond = 1'000'000;
constexpr std::size_t kTcpHeaderBytes = 6;  // transaction, protocol, length: the bytes before the
                                            // unit
// A line that delivers bytes for longer has another fault than a late reply.
constexpr std::int64_t kLongestDrainNs = 5'000'000'000;

struct Address {
  sockaddr_storage storage{};
  socklen_t size = 0;
};

bool parse_address(const LinkSettings& settings, Address& address) {
  const std::string host = settings.host == "localhost" ? "127.0.0.1" : settings.host;
  auto* v4 = reinterpret_cast<sockaddr_in*>(&address.storage);
  if (inet_pton(AF_INET, host.c_str(), &v4->sin_addr) == 1) {
    v4->sin_family = AF_INET;
    v4->sin_port = htons(settings.port);
    address.size = sizeof *v4;
    return true;
  }
  auto* v6 = reinterpret_cast<sockaddr_in6*>(&address.storage);
  if (inet_pton(AF_INET6, host.c_str(), &v6->sin6_addr) == 1) {
    v6->sin6_family = AF_INET6;
    v6->sin6_port = htons(settings.port);
    address.size = sizeof *v6;
    return true;
  }
  return false;
}

void set_option(int socket, int level, int name, int value) noexcept {
  // These options only speed up the detection of a lost peer; the response timeout detects it in
  // any case.
  (void)setsockopt(socket, level, name, &value, sizeof value);
}

// A peer that vanished without closing must be detected, and a request must not wait for a fuller
// packet.
void set_tcp_options(int socket, int response_timeout) noexcept {
  set_option(socket, IPPROTO_TCP, TCP_NODELAY, 1);
  set_option(socket, SOL_SOCKET, SO_KEEPALIVE, 1);
  set_option(socket, IPPROTO_TCP, TCP_KEEPIDLE, 5);
  set_option(socket, IPPROTO_TCP, TCP_KEEPINTVL, 2);
  set_option(socket, IPPROTO_TCP, TCP_KEEPCNT, 3);
  set_option(socket, IPPROTO_TCP, TCP_USER_TIMEOUT, std::max(5000, 2 * response_timeout));
}

constexpr char parity_letter(Parity parity) noexcept {
  switch (parity) {
    case Parity::even: return 'E';
    case Parity::odd: return 'O';
    case Parity::none: break;
  }
  return 'N';
}

// Errors of libmodbus for bytes that are no valid reply.
bool is_protocol_error(int error) noexcept {
  return error == EMBBADCRC || error == EMBBADDATA || error == EMBBADEXC || error == EMBUNKEXC ||
         error == EMBMDATA || error == EMBBADSLAVE;
}

// If the line has delivered as many bytes as a reply has and then is silent for this time, the
// reply is complete. Adapters on USB deliver every 16 ms.
constexpr std::int64_t kNoMoreNs = 50'000'000;

std::string unit_text(const Request& request) {
  return "unit " + std::to_string(request.unit) + ": ";
}

std::string in_words(int error) {
  return modbus_strerror(error);  // covers the system's errors as well
}

}  // namespace

ModbusTransport::ModbusTransport(LinkSettings settings, BusWaiter& waiter)
    : settings_(std::move(settings)), waiter_(waiter) {}

ModbusTransport::~ModbusTransport() { disconnect(); }

bool ModbusTransport::fail(std::string why) {
  error_ = std::move(why);
  disconnect();
  return false;
}

bool ModbusTransport::connect() {
  disconnect();
  const bool ok = settings_.transport == Transport::tcp ? connect_tcp() : connect_rtu();
  if (!ok) return false;
  quiet_from_ns_ = BusWaiter::now_ns();
  error_.clear();
  return true;
}

bool ModbusTransport::connect_tcp() {
  Address address;
  if (!parse_address(settings_, address)) {
    return fail("'" + settings_.host + "' is not a numeric IP address");
  }
  const int socket =
      ::socket(address.storage.ss_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, IPPROTO_TCP);
  if (socket < 0) return fail(in_words(errno));

  int error = 0;
  if (::connect(socket, reinterpret_cast<const sockaddr*>(&address.storage), address.size) != 0) {
    error = errno;
    if (error == EINPROGRESS) {
      const std::int64_t deadline =
          BusWaiter::now_ns() + settings_.connect_timeout_ms * kNanosecondsPerMillisecond;
      if (waiter_.wait_ready(socket, POLLOUT, deadline) != BusWaiter::Result::ready) {
        error = ETIMEDOUT;
      } else {
        socklen_t size = sizeof error;
        getsockopt(socket, SOL_SOCKET, SO_ERROR, &error, &size);
      }
    }
  }
  if (error != 0) {
    ::close(socket);
    return fail(in_words(error));
  }
  set_tcp_options(socket, response_timeout_ms(settings_));
  return adopt(socket);
}

bool ModbusTransport::adopt(int socket) {
  if (socket >= FD_SETSIZE) {  // libmodbus uses select(), which would write out of bounds
    ::close(socket);
    return fail("too many open files for libmodbus");
  }
  context_.reset(modbus_new_tcp("127.0.0.1", settings_.port));
  if (context_ == nullptr) {
    ::close(socket);
    return fail(in_words(errno));
  }
  modbus_set_socket(context_.get(), socket);
  modbus_set_byte_timeout(context_.get(), 0, 0);  // the response timeout covers the whole reply
  file_ = socket;
  transaction_ = 0;
  replies_ = 0;
  closed_by_device_ = false;
  return true;
}

bool ModbusTransport::connect_rtu() {
  context_.reset(modbus_new_rtu(settings_.device.c_str(), settings_.baud,
                                parity_letter(settings_.parity), settings_.data_bits,
                                settings_.stop_bits));
  if (context_ == nullptr) return fail(in_words(errno));
  if (modbus_connect(context_.get()) != 0) {
    const int error = errno;
    context_.reset();
    return fail(in_words(error));
  }
  file_ = modbus_get_socket(context_.get());
  if (file_ >= FD_SETSIZE) return fail("too many open files for libmodbus");
  // Shows other programs that the line is in use. If another program holds the lock, the loop still
  // uses the line, because it must reach its valve.
  (void)::flock(file_, LOCK_EX | LOCK_NB);
  if (settings_.rs485 && modbus_rtu_set_serial_mode(context_.get(), MODBUS_RTU_RS485) != 0) {
    return fail("the driver refuses RS-485 mode: " + in_words(errno));
  }
  echoes_ = false;
  surplus_bytes_ = 0;
  return true;
}

void ModbusTransport::disconnect() noexcept {
  if (file_ < 0) return;
  modbus_close(context_.get());
  context_.reset();
  file_ = -1;
}

std::int64_t ModbusTransport::character_ns() const noexcept {
  if (settings_.transport == Transport::tcp) return 0;
  constexpr std::int64_t kBitsPerCharacter = 11;
  return kBitsPerCharacter * 1'000'000'000 / settings_.baud;
}

std::int64_t ModbusTransport::frame_gap_ns() const noexcept {
  if (settings_.transport == Transport::tcp) return 0;
  constexpr int kFixedAboveBaud = 19200;
  constexpr std::int64_t kFixedNs = 1'750'000;
  return settings_.baud > kFixedAboveBaud ? kFixedNs : character_ns() * 7 / 2;
}

bool ModbusTransport::keep_pause() {
  const std::int64_t pause_ns = settings_.pause_ms * kNanosecondsPerMillisecond;
  return waiter_.sleep_until(quiet_from_ns_ + std::max(pause_ns, frame_gap_ns()));
}

Outcome ModbusTransport::exchange(const Request& request, Reply& reply, Settle settle) {
  drained_bytes_ = 0;
  reply = {};
  if (!connected()) return Outcome::disconnected;
  if (!keep_pause()) return Outcome::stopped;

  const Outcome outcome = send(request) ? receive(request, reply) : Outcome::disconnected;
  quiet_from_ns_ = BusWaiter::now_ns();
  if (outcome == Outcome::valid || outcome == Outcome::exception) ++replies_;
  if (outcome == Outcome::disconnected) {
    closed_by_device_ = true;
    disconnect();
  }
  if (outcome == Outcome::timeout || outcome == Outcome::invalid) {
    surplus_bytes_ = 0;
    if (settings_.transport == Transport::tcp) {
      disconnect();
    } else {
      const std::int64_t brief = frame_gap_ns();
      const std::int64_t full = response_timeout_ms(settings_) * kNanosecondsPerMillisecond;
      settle_line(settle == Settle::brief ? brief : std::max(brief, full));
    }
  }
  return outcome;
}

bool ModbusTransport::send(const Request& request) {
  const auto size = static_cast<int>(request.size);
  if (settings_.transport == Transport::rtu) {
    modbus_set_slave(context_.get(), request.unit);
    if (modbus_send_raw_request(context_.get(), request.bytes.data(), size) ==
        size + static_cast<int>(kCrcBytes)) {
      return true;
    }
    error_ = in_words(errno);
    return false;
  }
  // libmodbus numbers each raw request 0. A separate number distinguishes each reply from the one
  // before.
  ++transaction_;
  std::array<std::uint8_t, kTcpHeaderBytes + kMaxRequestBytes> frame{
      static_cast<std::uint8_t>(transaction_ >> 8),
      static_cast<std::uint8_t>(transaction_ & 0xFF),
      0,
      0,
      0,
      static_cast<std::uint8_t>(request.size)};
  std::copy_n(request.bytes.begin(), request.size, frame.begin() + kTcpHeaderBytes);
  const std::size_t frame_size = kTcpHeaderBytes + request.size;
  if (::send(file_, frame.data(), frame_size, MSG_NOSIGNAL) == static_cast<ssize_t>(frame_size)) {
    return true;
  }
  error_ = in_words(errno);
  return false;
}

Outcome ModbusTransport::receive(const Request& request, Reply& reply) {
  const std::int64_t sending = static_cast<std::int64_t>(request.size + kCrcBytes) * character_ns();
  const std::int64_t deadline_ns =
      BusWaiter::now_ns() + sending + response_timeout_ms(settings_) * kNanosecondsPerMillisecond;
  return settings_.transport == Transport::tcp ? receive_tcp(request, reply, deadline_ns)
                                               : receive_rtu(request, reply, deadline_ns);
}

Outcome ModbusTransport::no_reply(const Request& request, std::string why) {
  error_ = unit_text(request) + "no reply within " +
           std::to_string(response_timeout_ms(settings_)) + " ms " + std::move(why) + "when " +
           request_text(request);
  return Outcome::timeout;
}

Outcome ModbusTransport::receive_tcp(const Request& request, Reply& reply,
                                     std::int64_t deadline_ns) {
  switch (waiter_.wait_ready(file_, POLLIN, deadline_ns)) {
    case BusWaiter::Result::interrupted: return Outcome::stopped;
    case BusWaiter::Result::deadline: return no_reply(request, "");
    case BusWaiter::Result::ready: break;
  }

  const std::int64_t left_us =
      std::max<std::int64_t>((deadline_ns - BusWaiter::now_ns()) / 1000, 1000);
  modbus_set_response_timeout(context_.get(), static_cast<std::uint32_t>(left_us / 1'000'000),
                              static_cast<std::uint32_t>(left_us % 1'000'000));
  std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> frame{};
  const int received = modbus_receive_confirmation(context_.get(), frame.data());
  if (received < 0) {
    const int error = errno;
    const bool closed = error == ECONNRESET;
    error_ = unit_text(request) +
             (error == ETIMEDOUT ? "the reply broke off"
              : closed           ? "the device closed the connection without a reply"
                                 : in_words(error)) +
             " when " + request_text(request);
    return error == ETIMEDOUT || is_protocol_error(error) ? Outcome::invalid
                                                          : Outcome::disconnected;
  }

  const std::span<const std::uint8_t> bytes(frame.data(), static_cast<std::size_t>(received));
  const auto word = [&](std::size_t at) {
    return static_cast<std::size_t>((bytes[at] << 8) | bytes[at + 1]);
  };
  if (bytes.size() <= kTcpHeaderBytes || word(2) != 0 ||
      word(4) != bytes.size() - kTcpHeaderBytes) {
    error_ = unit_text(request) + "the reply's header does not fit it";
    return Outcome::invalid;
  }
  if (word(0) != transaction_) {
    error_ = unit_text(request) + "a reply to an earlier request, or with a wrong number";
    return Outcome::invalid;
  }
  return judge(request, bytes.subspan(kTcpHeaderBytes), reply);
}

Outcome ModbusTransport::receive_rtu(const Request& request, Reply& reply,
                                     std::int64_t deadline_ns) {
  constexpr std::size_t kMostBytes = std::size_t{2} * MODBUS_MAX_ADU_LENGTH;
  std::array<std::uint8_t, kMostBytes> bytes{};
  std::size_t size = 0;
  RtuReply found;
  while (found.state != RtuReply::State::found) {
    std::int64_t until_ns = deadline_ns;
    if (found.state == RtuReply::State::whole) {
      until_ns = std::min(deadline_ns, BusWaiter::now_ns() + kNoMoreNs);
    }
    const BusWaiter::Result result = waiter_.wait_ready(file_, POLLIN, until_ns);
    if (result == BusWaiter::Result::interrupted) return Outcome::stopped;
    if (result == BusWaiter::Result::deadline || size == bytes.size()) break;
    const ssize_t count = ::read(file_, bytes.data() + size, bytes.size() - size);
    if (count < 0 && errno == EAGAIN) continue;
    if (count <= 0) {
      error_ = "serial line lost";
      return Outcome::disconnected;
    }
    size += static_cast<std::size_t>(count);
    found = find_reply(request, std::span(bytes).first(size), echoes_);
  }
  if (request.read) echoes_ = found.echo;
  oddities_.echo = oddities_.echo || found.echo;
  if (found.state == RtuReply::State::found) {
    if (found.stray > 0) oddities_.stray_bytes = found.stray;
    const Outcome outcome = judge(request, found.body, reply);
    surplus_bytes_ = size - found.end;
    return outcome;
  }
  const std::size_t after_echo = size - (found.echo ? rtu_frame(request).size : 0);
  if (after_echo == 0) {
    return no_reply(request, found.echo ? "(only an echo of the request arrived) " : "");
  }
  error_ = unit_text(request) +
           (found.state == RtuReply::State::whole ? "a reply with a wrong checksum"
                                                  : "the reply broke off") +
           " when " + request_text(request);
  return Outcome::invalid;
}

// `bytes` start with the unit and end with the protocol data unit.
Outcome ModbusTransport::judge(const Request& request, std::span<const std::uint8_t> bytes,
                               Reply& reply) {
  constexpr std::uint8_t kIllegalFunction = 1;
  switch (check_reply(request, bytes, reply)) {
    case ReplyCheck::valid: return Outcome::valid;
    case ReplyCheck::exception:
      error_ =
          unit_text(request) + exception_text(reply.exception) + " when " + request_text(request);
      if (reply.exception == kIllegalFunction && !request.read) {
        error_ += ". " + write_function_hint(request);
      }
      return Outcome::exception;
    case ReplyCheck::mismatch: break;
  }
  error_ = unit_text(request) + mismatch_text(request, bytes);
  return Outcome::invalid;
}

std::size_t ModbusTransport::discard_unasked() {
  if (!connected() || !keep_pause())
    return 0;  // a reply that is late by less than the pause
               // counts
  pollfd line{file_, POLLIN, 0};
  const bool more = ::poll(&line, 1, 0) > 0;
  if (settings_.transport == Transport::rtu) {
    drained_bytes_ = std::exchange(surplus_bytes_, 0);
    if (more) settle_line(frame_gap_ns());
    if (drained_bytes_ >= kShortestReplyBytes) return drained_bytes_;
    if (drained_bytes_ > 0) oddities_.stray_bytes = drained_bytes_;
    return 0;
  }
  if (!more) return 0;
  std::array<std::uint8_t, MODBUS_TCP_MAX_ADU_LENGTH> bytes{};
  const ssize_t count = ::recv(file_, bytes.data(), bytes.size(), MSG_DONTWAIT);
  closed_by_device_ = count <= 0;
  fail(count > 0 ? "bytes without a request" : "closed by the device");
  return count > 0 ? static_cast<std::size_t>(count) : 0;
}

void ModbusTransport::settle_line(std::int64_t silence_ns) {
  const std::int64_t give_up = BusWaiter::now_ns() + kLongestDrainNs;
  std::int64_t silent_at = BusWaiter::now_ns() + silence_ns;
  std::array<std::uint8_t, MODBUS_MAX_ADU_LENGTH> bytes{};
  while (waiter_.wait_ready(file_, POLLIN, silent_at) == BusWaiter::Result::ready) {
    const ssize_t count = ::read(file_, bytes.data(), bytes.size());
    if (count < 0 && errno == EAGAIN) continue;
    if (count <= 0) {
      fail("serial line lost");
      return;
    }
    drained_bytes_ += static_cast<std::size_t>(count);
    const std::int64_t now = BusWaiter::now_ns();
    if (now > give_up) {
      fail("the line never falls silent");
      return;
    }
    silent_at = now + silence_ns;
  }
  quiet_from_ns_ = BusWaiter::now_ns();
}

}  // namespace loopwarden::hal::modbus
