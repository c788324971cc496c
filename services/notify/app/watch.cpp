// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <memory>
#include <stdexcept>
#include <utility>

#include "services/notify/app/commands.hpp"
#include "services/notify/app/notifier.hpp"
#include "base/exit_code.hpp"
#include "base/signals.hpp"

namespace loopwarden::notify {
namespace {

constexpr std::chrono::milliseconds kRound{200};
// An attempt under way is given up if it has not ended after this time.
constexpr std::chrono::milliseconds kPatienceAtEnd{5000};

bool end_asked() { return base::wait_for_signal({SIGTERM, SIGINT}, kRound) != 0; }

void run_rounds(Notifier& notifier) {
  std::string told;
  while (!end_asked()) {
    notifier.step();
    const std::string status = notifier.status();
    if (status != told) sd_notify(0, fmt::format("STATUS={}", status).c_str());
    told = status;
    sd_notify(0, "WATCHDOG=1");
  }
}

}  // namespace

int watch(NotifyConfig config) {
  std::unique_ptr<Notifier> notifier;
  try {
    notifier = std::make_unique<Notifier>(std::move(config));
  } catch (const sqlite::Error& e) {
    spdlog::error("{}", e.what());
    return e.other_version() ? kExitConfiguration : kExitIo;
  } catch (const std::runtime_error& e) {
    spdlog::error("{}", e.what());
    return kExitConfiguration;
  }
  notifier->start();
  sd_notify(0, "READY=1");
  run_rounds(*notifier);
  sd_notify(0, "STOPPING=1");
  // Hanging threads still use objects that the destructors would destroy.
  if (!notifier->stop_for(kPatienceAtEnd)) ::_exit(kExitIo);
  return kExitOk;
}

}  // namespace loopwarden::notify
