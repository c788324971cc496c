// SPDX-License-Identifier: Apache-2.0
// Sends any bytes as a line to each of the daemon's sockets, with each set of rights. The answer is
// always one line of JSON with the outcome. A socket without rights executes no command. The
// outputs of the loop stay within its limits.
#include <spdlog/spdlog.h>

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "tests/daemon/console/console.hpp"
#include "tests/fuzz/require.hpp"

namespace {

using namespace loopwarden;
using daemon::console::SocketName;
using daemon::console_bench::Console;
using nlohmann::json;
using tests::fuzz::require;

struct Plant : Console {
  Plant() {
    spdlog::set_level(spdlog::level::off);
    run(2);
  }
  std::string answer(SocketName socket, std::string_view line) {
    if (socket == SocketName::status) return readers->answer(line);
    const base::LocalServer::Answer given = server->answer(line, socket, 1000);
    if (const auto* text = std::get_if<std::string>(&given)) return *text;
    const auto& later = std::get<base::LocalServer::Later>(given);
    std::optional<std::string> text;
    while (!text) text = later();  // the answer arrives with the journal's line or without it
    return *text;
  }
};

void check_answer(const std::string& text) {
  require(text.find('\n') == std::string::npos, "one line");
  const json answer = json::parse(text, nullptr, false);
  require(answer.is_object(), "a JSON object");
  require(answer.contains("ok") && answer.at("ok").is_boolean(), "whether it was done");
  require(answer.at("ok") == true || answer.at("error").is_string(), "why not");
}

}  // namespace

// First byte: bits 0 and 1 select the socket, bits 2 to 4 its rights. The other bytes are the line.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Plant plant;
  if (size < 2) return 0;
  const auto socket = static_cast<SocketName>(data[0] & 3U);
  const config::SocketRights rights{.alarms = (data[0] & 4U) != 0,
                                    .control = (data[0] & 8U) != 0,
                                    .tuning = (data[0] & 16U) != 0,
                                    .reports = (data[0] & 32U) != 0,
                                    .tests = (data[0] & 64U) != 0};
  plant.server->set_rights({.page = rights, .edge = rights});
  const std::string line(data + 1, data + size);
  const std::uint64_t before = plant.loops.front().channels->operator_commands.commands.room();
  check_answer(plant.answer(socket, line));
  const bool ordered = plant.loops.front().channels->operator_commands.commands.room() != before;
  const bool may = socket == SocketName::control ||
                   (socket != SocketName::status && rights.control) ||
                   (socket == SocketName::page && rights.tuning);
  require(may || !ordered, "who may not order does not");
  plant.run(1);
  const auto& io = static_cast<tests::FakeLoopIo&>(*plant.loops.front().io);
  require(io.written >= 0.0 && io.written <= 100.0, "an output within its limits");
  return 0;
}
