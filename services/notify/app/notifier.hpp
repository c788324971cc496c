// SPDX-License-Identifier: Apache-2.0
// All parts together: what the watcher reads becomes events, events become messages, workers send them.
#pragma once

#include <chrono>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "services/notify/app/channel_worker.hpp"
#include "services/notify/config/notify_config.hpp"
#include "services/notify/store/outbox.hpp"
#include "services/notify/subscription/watcher.hpp"

namespace loopwarden::notify {

class Notifier {
 public:
  // Opens the store and the channels. Throws sqlite::Error, or std::runtime_error where a secret is missing.
  explicit Notifier(NotifyConfig config);
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  void start();
  // One round: looks, stores, makes messages. To be called several times a second.
  void step();
  // False if a thread still hangs in a call when the patience is at its end.
  bool stop_for(std::chrono::milliseconds patience);

  // One line for the service manager.
  std::string status() const;

 private:
  struct Line {
    ChannelRule rule;
    std::vector<Waiting> waiting;
    std::deque<std::int64_t> made_ms;  // of the newest messages, oldest first
    std::unique_ptr<ChannelWorker> worker;
  };
  void open_lines();
  void look(std::int64_t now_ms);
  void store(const Step& step, std::int64_t now_ms);
  void make_messages(Line& line, std::int64_t now_ms);

  NotifyConfig config_;
  std::unique_ptr<Outbox> outbox_;
  WatchRules rules_;
  std::vector<AlarmReading> newest_;
  std::optional<Snapshot> unstored_;  // what was read while the disk did not take it
  PictureMaker pictures_;
  std::map<std::string, Line> lines_;
  Watcher watcher_;
  std::string trouble_;
};

// Opens the database of the configuration's state directory; one that is damaged or none of ours is moved aside.
std::unique_ptr<Outbox> open_outbox(const std::string& state_directory);
std::string outbox_file(const std::string& state_directory);

}  // namespace loopwarden::notify
