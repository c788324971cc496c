// SPDX-License-Identifier: Apache-2.0
// Reads any bytes as a loop file and as loopwardend.yaml. The reader must not crash, and must
// report every refused file.
#include <cstdint>
#include <cstdlib>
#include <map>
#include <string_view>

#include "config/config_reader.hpp"

namespace {

using namespace loopwarden;

template <class T>
void check(const config::Loaded<T>& loaded) {
  if (!loaded && config::to_text(loaded.diagnostics).empty()) std::abort();
}

config::DaemonConfig daemon() {
  hal::modbus::LinkSettings tcp;
  tcp.name = "skid";
  hal::modbus::LinkSettings rtu;
  rtu.name = "line_1";
  rtu.transport = hal::modbus::Transport::rtu;
  config::DaemonConfig daemon;
  daemon.links = {{"skid", tcp}, {"line_1", rtu}};
  daemon.feeders = {{"opcua", {}}};
  return daemon;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const config::DaemonConfig kDaemon = daemon();
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  check(config::read_loop_text("loops.d/fuzz.yaml", text, kDaemon));
  check(config::read_daemon_text("loopwardend.yaml", text));
  return 0;
}
