// SPDX-License-Identifier: Apache-2.0
#include "daemon/probe/link_owners.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>
#include <variant>
#include <vector>

#include "base/file.hpp"
#include "base/local_address.hpp"
#include "base/local_socket.hpp"
#include "config/config_reader.hpp"
#include "protocol/ask.hpp"

namespace loopwarden::daemon::probe {
namespace {

namespace fs = std::filesystem;
using hal::modbus::LinkSettings;

// What names the same line by several links of the file system.
fs::path real(const std::string& device) {
  std::error_code ignored;
  const fs::path path = fs::weakly_canonical(device, ignored);
  return path.empty() ? fs::path(device) : path;
}

std::string numeric(const std::string& host) { return host == "localhost" ? "127.0.0.1" : host; }

bool same(const LinkSettings& a, const LinkSettings& b) {
  if (a.transport != b.transport) return false;
  if (a.transport == hal::modbus::Transport::rtu) return real(a.device) == real(b.device);
  return numeric(a.host) == numeric(b.host) && a.port == b.port;
}

std::vector<const LinkSettings*> links_of(const config::LoopConfig& loop) {
  if (const auto* io = std::get_if<hal::modbus::LoopModbusSettings>(&loop.io)) {
    return {&io->transmitter_link, &io->positioner_link};
  }
  std::vector<const LinkSettings*> links;
  if (const auto* io = std::get_if<hal::modbus::ModbusSourceSettings>(&loop.io)) {
    links = {&io->process_variable.link, &io->output.link};
    for (const auto* point : {&io->set_point, &io->stem, &io->mode}) {
      if (*point) links.push_back(&(*point)->link);
    }
  }
  return links;
}

// The status of the daemon whose sockets are in this folder; nullopt: none runs. Throws std::runtime_error where one is
// there and does not answer.
std::optional<protocol::Status> running_daemon(const fs::path& runtime_directory) {
  const std::string path = (runtime_directory / "status.sock").string();
  const base::File tried(base::try_local_connection(path));
  // Of a daemon that was killed the socket is left, and nobody listens.
  if (!tried.is_open() && (errno == ENOENT || errno == ECONNREFUSED)) return std::nullopt;
  base::LocalClient client(path);
  const nlohmann::json request = protocol::StatusRequest{};
  return protocol::read_answer<protocol::Status>(
      protocol::answer_in(client.request(request.dump(), base::LocalClient::kPatience)));
}

std::string runtime_directory_of(const fs::path& folder) {
  const std::string file = (folder / "loopwardend.yaml").string();
  if (const std::optional<std::string> text = base::read_file(file)) {
    if (const auto daemon = config::read_daemon_text(file, *text)) return daemon->runtime_directory;
  }
  return config::DaemonConfig{}.runtime_directory;
}

}  // namespace

std::string owner_of(const LinkSettings& link, const fs::path& folder) {
  std::optional<protocol::Status> running;
  try {
    running = running_daemon(runtime_directory_of(folder));
  } catch (const std::exception& e) {
    return fmt::format("a daemon runs and does not say which loops: {}", e.what());
  }
  if (!running) return {};
  const auto files = config::read_configuration(folder);
  if (!files) {
    return fmt::format(
        "a daemon runs, and its files in {} have errors by now: nothing tells which "
        "links it has",
        folder.string());
  }
  for (const protocol::LoopStatus& loop : running->loops) {
    const auto file =
        std::find_if(files->loops.begin(), files->loops.end(),
                     [&](const config::LoopConfig& one) { return one.name == loop.name; });
    if (file == files->loops.end()) {
      return fmt::format("the daemon runs {}, of which {} has no file: nothing tells its links",
                         loop.name, folder.string());
    }
    const std::vector<const LinkSettings*> links = links_of(*file);
    if (std::any_of(links.begin(), links.end(), [&](const auto* one) { return same(*one, link); }))
      return fmt::format("{} runs on it", loop.name);
  }
  const auto& server = files->daemon.modbus_server;
  if (server && server->serial && same(server->serial->line, link)) {
    return "the daemon answers its masters on it";
  }
  return {};
}

}  // namespace loopwarden::daemon::probe
