// SPDX-License-Identifier: Apache-2.0
#include "daemon/probe/probe.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <utility>

#include "base/exit_code.hpp"
#include "daemon/probe/link_owners.hpp"
#include "hal/modbus/register_codec.hpp"

namespace loopwarden::daemon::probe {
namespace {

using namespace hal::modbus;

template <class T>
T whole(std::uint64_t number, std::uint64_t least, std::uint64_t most, const char* what) {
  if (number < least || number > most) {
    throw std::invalid_argument(fmt::format("{} must be {} to {}", what, least, most));
  }
  return static_cast<T>(number);
}

LinkSettings link_of(const protocol::Probe& asked) {
  LinkSettings link;
  link.name = "probe";
  if (asked.transport == "tcp") {
    link.host = asked.host;
    link.port = whole<std::uint16_t>(asked.port, 1, 65535, "port");
    return link;
  }
  if (asked.transport != "rtu") throw std::invalid_argument("transport is tcp or rtu");
  link.transport = Transport::rtu;
  link.device = asked.device;
  link.baud = whole<int>(asked.baud, 1200, 115200, "baud");
  link.stop_bits = whole<int>(asked.stop_bits, 1, 2, "stop_bits");
  if (asked.parity == "none") {
    link.parity = Parity::none;
  } else if (asked.parity == "odd") {
    link.parity = Parity::odd;
  } else if (asked.parity != "even") {
    throw std::invalid_argument("parity is none, even or odd");
  }
  return link;
}

template <class E, std::size_t N>
E word(const std::string& text, const std::array<std::pair<const char*, E>, N>& words,
       const char* what) {
  for (const auto& [name, meaning] : words) {
    if (text == name) return meaning;
  }
  throw std::invalid_argument(fmt::format("{}: not known: '{}'", what, text));
}

RegisterSpec spec_of(const protocol::Probe& asked) {
  using Type = std::pair<const char*, RegisterType>;
  using Order = std::pair<const char*, ByteOrder>;
  static constexpr std::array kTypes{
      Type{"u16", RegisterType::u16}, Type{"i16", RegisterType::i16},
      Type{"u32", RegisterType::u32}, Type{"i32", RegisterType::i32},
      Type{"f32", RegisterType::f32}, Type{"f64", RegisterType::f64}};
  static constexpr std::array kOrders{
      Order{"abcd", ByteOrder::abcd}, Order{"cdab", ByteOrder::cdab},
      Order{"badc", ByteOrder::badc}, Order{"dcba", ByteOrder::dcba}};
  RegisterSpec spec;
  spec.type = word(asked.type, kTypes, "type");
  spec.order = word(asked.order, kOrders, "order");
  return spec;
}

Request request_of(const protocol::Probe& asked, std::uint16_t count) {
  if (asked.table != "input" && asked.table != "holding") {
    throw std::invalid_argument("table is input or holding");
  }
  const auto function =
      asked.table == "input" ? ReadFunction::input_registers : ReadFunction::holding_registers;
  constexpr std::uint64_t kMostAddresses = 65536;
  const auto address = whole<std::uint16_t>(asked.address, 0, kMostAddresses - count, "address");
  return read_request(whole<std::uint8_t>(asked.unit, 0, 255, "unit"), function, address, count);
}

}  // namespace

std::string Prober::lock(const LinkSettings& link) {
  line_ = {};
  if (link.transport == Transport::tcp) return {};
  // Opened without changing the line's settings, because another program may be in the middle of a
  // request.
  line_ = base::File(link.device, O_RDWR | O_NONBLOCK | O_NOCTTY);
  int exclusive = 0;
  if (!line_.is_open()) {
    if (errno != EBUSY) return {};  // the transport reports the error
  } else if ((::ioctl(line_.fd(), TIOCGEXCL, &exclusive) != 0 || exclusive == 0) &&
             ::flock(line_.fd(), LOCK_EX | LOCK_NB) == 0) {
    return {};
  }
  line_ = {};
  return "another program has locked " + link.device;
}

protocol::Probed Prober::read(const protocol::Probe& asked) {
  try {
    const LinkSettings link = link_of(asked);
    const RegisterSpec spec = spec_of(asked);
    const Request request = request_of(asked, register_count(spec.type));
    // Checked before each request, because a daemon may have started meanwhile.
    if (const std::string owner = owner_of(link, folder_); !owner.empty()) {
      transport_.reset();
      line_ = {};
      return {.state = "refused", .why = owner};
    }
    if (!transport_ || link_ != link) {
      transport_.reset();
      if (std::string locked = lock(link); !locked.empty()) {
        return {.state = "refused", .why = std::move(locked)};
      }
      transport_.emplace(link, waiter_);
      link_ = link;
    }
    if (!transport_->connected() && !transport_->connect()) {
      return {.state = "silent", .why = transport_->error()};
    }
    Reply reply;
    const Outcome outcome = transport_->exchange(request, reply, ModbusTransport::Settle::full);
    if (outcome == Outcome::valid) {
      const auto words = reply.view();
      return {.state = "read",
              .why = {},
              .registers = {words.begin(), words.end()},
              .raw = decode(spec, words)};
    }
    return {.state = outcome == Outcome::exception ? "error" : "silent",
            .why = transport_->error()};
  } catch (const std::invalid_argument& e) {
    return {.state = "refused", .why = e.what()};
  }
}

int serve(const std::filesystem::path& folder, int input, std::chrono::milliseconds patience) {
  constexpr std::size_t kLongestLine = 4096;
  Prober prober(folder);
  std::string received;
  for (;;) {
    pollfd waiting{input, POLLIN, 0};
    if (::poll(&waiting, 1, static_cast<int>(patience.count())) <= 0) return kExitOk;
    std::array<char, 1024> bytes{};
    const ssize_t count = ::read(input, bytes.data(), bytes.size());
    if (count <= 0) return kExitOk;
    received.append(bytes.data(), static_cast<std::size_t>(count));
    for (std::size_t end = 0; (end = received.find('\n')) != std::string::npos;) {
      protocol::Probed answer;
      try {
        answer = prober.read(nlohmann::json::parse(received.substr(0, end)).get<protocol::Probe>());
      } catch (const nlohmann::json::exception& e) {
        answer = {.state = "refused", .why = e.what()};
      }
      const nlohmann::json line = answer;
      fmt::print("{}\n", line.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
      std::fflush(stdout);
      received.erase(0, end + 1);
    }
    if (received.size() > kLongestLine) return kExitData;
  }
}

}  // namespace loopwarden::daemon::probe
