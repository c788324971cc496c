// SPDX-License-Identifier: Apache-2.0
// loopwarden register-map: writes the Modbus map as a document, an address list or a master's
// configuration.
#include <fmt/format.h>

#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "config/config_reader.hpp"
#include "workbench/command_line/frame.hpp"
#include "workbench/commands/subcommands.hpp"
#include "workbench/text/register_map_text.hpp"

namespace loopwarden::workbench {
namespace {

struct RegisterMapOptions {
  std::string format = "markdown";
  std::string config;
  std::string host;
  int port = 0;
  bool json = false;
};

int run_register_map(const RegisterMapOptions& options) {
  MapOptions map_options;
  if (!options.config.empty()) {
    const auto configuration = config::read_configuration(options.config);
    fmt::print(stderr, "{}", config::to_text(configuration.diagnostics));
    if (!configuration) return kExitConfiguration;
    map_options.loops.clear();
    for (const config::LoopConfig& loop : configuration->loops) {
      map_options.loops.push_back(loop.name);
    }
    if (const auto& server = configuration->daemon.modbus_server) {
      map_options.port = server->port;
      map_options.unit = server->unit;
      map_options.word_order = server->word_order;
    }
  }
  if (!options.host.empty()) map_options.host = options.host;
  if (options.port > 0) map_options.port = static_cast<std::uint16_t>(options.port);
  using Make = std::string (*)(const MapOptions&);
  static const std::map<std::string, Make> kFormats{
      {"markdown", [](const MapOptions&) { return map_markdown(); }},
      {"csv", map_csv},
      {"mbpoll", map_mbpoll},
      {"pymodbus", map_pymodbus},
      {"telegraf", map_telegraf},
      {"javascript", map_javascript},
      {"node-red", map_node_red}};
  if (options.json) {
    show_json(map_json(map_options));
    return kExitOk;
  }
  fmt::print("{}", kFormats.at(options.format)(map_options));
  return kExitOk;
}

}  // namespace

void add_register_map(Program& program) {
  auto [command, o] =
      program.command("register-map", "Print the daemon's Modbus map, for people and for masters",
                      run_register_map);
  command.setting(
      "--format", o.format, "markdown, csv, mbpoll, pymodbus, javascript, telegraf or node-red",
      one_of({"markdown", "csv", "mbpoll", "pymodbus", "javascript", "telegraf", "node-red"}));
  command.option("--config", o.config,
                 "the daemon's configuration folder: its loops, port, unit and word order");
  command.option("--host", o.host, "the daemon's address as masters see it");
  command.option("--port", o.port, "port, if it differs from the configuration", between(1, 65535));
  command.flag("--json", o.json, "print every address as JSON, instead of a format");
  command.footer("Example: loopwarden register-map --format pymodbus --config /etc/loopwardend");
}

}  // namespace loopwarden::workbench
