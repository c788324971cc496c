// SPDX-License-Identifier: Apache-2.0
#include "daemon/app/console_sources.hpp"

#include "daemon/app/assemble.hpp"
#include "daemon/app/status.hpp"

namespace loopwarden::daemon {

protocol::DaemonStatus ConsoleSources::status() const { return status_of(assembly_); }
protocol::Description ConsoleSources::description() const { return description_of(assembly_); }
protocol::Links ConsoleSources::links() const { return links_of(assembly_); }
std::filesystem::path ConsoleSources::configuration() const {
  return assembly_.origin.configuration;
}
std::uint32_t ConsoleSources::config_hash() const { return assembly_.reloader.config_hash(); }
std::string ConsoleSources::twin(std::size_t loop) const { return assembly_.evidence.twin(loop); }
gateway::BoxReading ConsoleSources::box() const { return box_reading_of(assembly_); }
gateway::ServerState ConsoleSources::modbus_server() const {
  return assembly_.modbus ? assembly_.modbus->gateway.state() : gateway::ServerState{};
}

std::uint64_t ConsoleSources::reload(const std::string& peer, bool dry_run, bool take_file) {
  return assembly_.reloader.post(peer, dry_run, take_file);
}
std::optional<protocol::ReloadState> ConsoleSources::reload_state(std::uint64_t number) const {
  return assembly_.reloader.state(number);
}
bool ConsoleSources::command_kept(std::size_t loop) const { return assembly_.keeper->kept(loop); }

}  // namespace loopwarden::daemon
