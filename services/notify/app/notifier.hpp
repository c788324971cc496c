// SPDX-License-Identifier: Apache-2.0
// Connects all parts: snapshots of the watcher become events, then messages, which workers send.
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
  // Opens store and channels. Throws sqlite::Error, or std::runtime_error if a secret is missing.
  explicit Notifier(NotifyConfig config);
  Notifier(const Notifier&) = delete;
  Notifier& operator=(const Notifier&) = delete;

  void start();
  // Runs one round: reads, stores, makes messages. Call it several times per second.
  void step();
  // Returns false if a thread still hangs in a call after `patience`.
  bool stop_for(std::chrono::milliseconds patience);

  // Returns one line for the service manager.
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
  std::optional<Snapshot> unstored_;  // the snapshot that the disk has not taken yet
  PictureMaker pictures_;
  std::map<std::string, Line> lines_;
  Watcher watcher_;
  std::string trouble_;
};

// Opens the database in the configuration's state directory. A damaged or foreign one is moved
// aside.
std::unique_ptr<Outbox> open_outbox(const std::string& state_directory);
std::string outbox_file(const std::string& state_directory);

}  // namespace loopwarden::notify
