// SPDX-License-Identifier: Apache-2.0
#include "daemon/probe/link_owners.hpp"

#include <fmt/format.h>

#include <cerrno>
#include <nlohmann/json.hpp>
#include <optional>

#include "base/device_name.hpp"
#include "base/file.hpp"
#include "base/local_address.hpp"
#include "base/local_socket.hpp"
#include "config/config_reader.hpp"
#include "config/link_address.hpp"
#include "daemon/protocol/ask.hpp"

namespace loopwarden::daemon::probe {
namespace {

namespace fs = std::filesystem;
using hal::modbus::LinkSettings;

bool same(const LinkSettings& asked, const protocol::LinkInUse& used) {
  if ((asked.transport == hal::modbus::Transport::rtu) != (used.transport == "rtu")) return false;
  if (used.transport == "rtu") {
    return base::device_name(asked.device) == base::device_name(used.device);
  }
  return base::address_name(asked.host) == base::address_name(used.host) && asked.port == used.port;
}

// Returns the links of the daemon whose sockets are in this folder; nullopt if no daemon runs.
// Throws std::runtime_error if a daemon runs but does not answer.
std::optional<protocol::Links> links_of_daemon(const fs::path& runtime_directory) {
  const std::string path = (runtime_directory / "status.sock").string();
  const base::File tried(base::try_local_connection(path));
  // A killed daemon leaves its socket without a listener.
  if (!tried.is_open() && (errno == ENOENT || errno == ECONNREFUSED)) return std::nullopt;
  base::LocalClient client(path);
  const nlohmann::json request = protocol::LinksRequest{};
  return protocol::read_answer<protocol::Links>(
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
  try {
    const auto running = links_of_daemon(runtime_directory_of(folder));
    if (!running) return {};
    for (const protocol::LinkInUse& used : running->links) {
      if (same(link, used)) return used.by;
    }
    return {};
  } catch (const std::exception& e) {
    return fmt::format("a daemon runs but does not report its links: {}", e.what());
  }
}

}  // namespace loopwarden::daemon::probe
