// SPDX-License-Identifier: Apache-2.0
#include "daemon/gateway/serial_server.hpp"

#include <fcntl.h>
#include <modbus/modbus.h>
#include <poll.h>
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

namespace loopwarden::daemon::gateway {
namespace {

constexpr std::int64_t kLongestPause = 50'000'000;  // ns, within a frame
constexpr std::int64_t kRetry = 5'000'000'000;      // ns, between attempts to open the line
constexpr std::chrono::milliseconds kIdle{1000};
constexpr std::size_t kLeastFrame = 4;  // unit, function, checksum
constexpr std::size_t kChecksum = 2;
constexpr std::uint8_t kBroadcast = 0;

char parity_letter(hal::modbus::Parity parity) {
  switch (parity) {
    case hal::modbus::Parity::none: return 'N';
    case hal::modbus::Parity::even: return 'E';
    case hal::modbus::Parity::odd: break;
  }
  return 'O';
}

}  // namespace

struct SerialServer::Line {
  struct Deleter {
    void operator()(modbus_t* open) const noexcept {
      modbus_close(open);
      modbus_free(open);
    }
  };
  std::unique_ptr<modbus_t, Deleter> context;
};

std::size_t serial_request_size(std::span<const std::uint8_t> frame) noexcept {
  constexpr std::size_t kShort = 8;  // unit, function, two words, checksum
  if (frame.size() < 2) return 0;
  switch (frame[1]) {
    case 1:
    case 2:
    case 3:
    case 4:
    case 5:
    case 6: return kShort;
    case 15:
    case 16: return frame.size() < 7 ? 0 : 9U + frame[6];
    case 43: return 7;  // MEI type, code, object
    default: return 0;
  }
}

std::uint16_t serial_checksum(std::span<const std::uint8_t> bytes) noexcept {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? crc >> 1U ^ 0xA001U : crc >> 1U;
  }
  return static_cast<std::uint16_t>(crc);
}

SerialServer::SerialServer(SerialServerSettings settings, base::Clock& clock, Answer answer)
    : settings_(std::move(settings)),
      clock_(clock),
      answer_(std::move(answer)),
      peer_{settings_.line.device, settings_.writes} {
  open(clock_.now_ns());
}

SerialServer::~SerialServer() = default;

void SerialServer::open(std::int64_t now_ns) {
  retry_ns_ = now_ns + kRetry;
  const hal::modbus::LinkSettings& line = settings_.line;
  auto fresh = std::make_unique<Line>();
  fresh->context.reset(modbus_new_rtu(line.device.c_str(), line.baud, parity_letter(line.parity),
                                      line.data_bits, line.stop_bits));
  // libmodbus uses the address for its own frames only, which are not used here.
  if (!fresh->context || modbus_connect(fresh->context.get()) != 0) {
    close_line(std::generic_category().message(errno));
    return;
  }
  if (line.rs485 && modbus_rtu_set_serial_mode(fresh->context.get(), MODBUS_RTU_RS485) != 0) {
    close_line("the driver refuses RS-485 mode: " + std::generic_category().message(errno));
    return;
  }
  line_ = std::move(fresh);
  fd_ = modbus_get_socket(line_->context.get());
  fcntl(fd_, F_SETFL, fcntl(fd_, F_GETFL) | O_NONBLOCK);
  size_ = 0;
  overrun_ = false;
  counters_.open = true;
  reported_.clear();
  spdlog::info("Modbus RTU slave: unit {} on {}", settings_.unit, line.device);
}

void SerialServer::close_line(const std::string& why) {
  line_.reset();
  fd_ = -1;
  ready_ = nullptr;
  counters_.open = false;
  if (reported_ == why) return;
  reported_ = why;
  spdlog::error("Modbus RTU slave: {}: {}; retried every {} s", settings_.line.device, why,
                kRetry / 1'000'000'000);
}

std::int64_t SerialServer::gap_ns() const noexcept {
  constexpr std::int64_t kFastGap = 1'750'000;
  constexpr std::int64_t kBitsIn3_5Characters = 77;  // times two
  if (settings_.line.baud > 19200) return kFastGap;
  return kBitsIn3_5Characters * 500'000'000 / settings_.line.baud;
}

std::chrono::milliseconds SerialServer::patience() const noexcept {
  if (fd_ < 0 || size_ == 0) return ready_ ? Reply::kBetweenLooks : kIdle;
  // Rounded up: a millisecond more of silence does no harm; one less would not end a frame.
  return std::chrono::milliseconds(gap_ns() / 1'000'000 + 1);
}

void SerialServer::serve() {
  const std::int64_t now_ns = clock_.now_ns();
  if (fd_ < 0) {
    if (now_ns >= retry_ns_) open(now_ns);
    return;
  }
  if (!receive(now_ns)) {
    const int error = errno;
    close_line(error == 0 ? "the line hung up" : std::generic_category().message(error));
    return;
  }
  if (size_ > 0) ready_ = nullptr;
  if (ready_ && ready_()) send_answer();
  if (size_ > 0 && now_ns - last_byte_ns_ >= gap_ns()) end_of_frame(now_ns - last_byte_ns_);
}

// Returns false if the line is lost.
bool SerialServer::receive(std::int64_t now_ns) {
  for (;;) {
    std::array<std::uint8_t, kMostFrame> some{};
    errno = 0;
    const ssize_t n = read(fd_, some.data(), some.size());
    if (n < 0) return errno == EAGAIN || errno == EINTR;
    // read() returns 0 both for a terminal without data and for one that hung up.
    if (n == 0) {
      pollfd line{fd_, POLLIN, 0};
      return poll(&line, 1, 0) <= 0 || (line.revents & (POLLHUP | POLLERR | POLLNVAL)) == 0;
    }
    last_byte_ns_ = now_ns;
    const auto count = static_cast<std::size_t>(n);
    const std::size_t room = received_.size() - size_;
    overrun_ = overrun_ || count > room;
    std::copy_n(some.begin(), std::min(count, room),
                received_.begin() + static_cast<std::ptrdiff_t>(size_));
    size_ += std::min(count, room);
  }
}

void SerialServer::end_of_frame(std::int64_t silence_ns) {
  const std::span<const std::uint8_t> frame(received_.data(), size_);
  const bool for_us = frame[0] == settings_.unit || frame[0] == kBroadcast;
  if (for_us && !overrun_ && size_ >= kLeastFrame) {
    const auto carried = static_cast<std::uint16_t>(frame[size_ - 2] | frame[size_ - 1] << 8U);
    if (carried == serial_checksum(frame.first(size_ - kChecksum))) {
      answer_frame(size_);
      size_ = 0;
      return;
    }
  }
  const std::size_t wanted = serial_request_size(frame);
  const bool may_grow = for_us && !overrun_ && (wanted == 0 || size_ < wanted);
  if (may_grow && silence_ns < kLongestPause) return;
  if (for_us) ++counters_.malformed;
  size_ = 0;
  overrun_ = false;
}

void SerialServer::answer_frame(std::size_t size) {
  ++counters_.requests;
  const std::uint8_t unit = received_[0];
  Reply reply = answer_({received_.data() + 1, size - 1 - kChecksum}, peer_);
  if (unit == kBroadcast) return;
  const Pdu& pdu = reply.pdu;
  to_send_[0] = unit;
  std::copy_n(pdu.bytes.begin(), pdu.size, to_send_.begin() + 1);
  const std::uint16_t checksum = serial_checksum({to_send_.data(), pdu.size + 1});
  to_send_[pdu.size + 1] = static_cast<std::uint8_t>(checksum & 0xFFU);
  to_send_[pdu.size + 2] = static_cast<std::uint8_t>(checksum >> 8U);
  to_send_size_ = pdu.size + 3;
  ready_ = std::move(reply.ready);
  if (!ready_ || ready_()) send_answer();
}

void SerialServer::send_answer() {
  ready_ = nullptr;
  // The driver's buffer is larger than a frame. Bytes that do not fit are lost to the master.
  if (write(fd_, to_send_.data(), to_send_size_) < 0 && errno != EAGAIN) {
    close_line(std::generic_category().message(errno));
  }
}

}  // namespace loopwarden::daemon::gateway
