// SPDX-License-Identifier: Apache-2.0
// Draws the pictures of a message's alarms from the recorder's segments and the daemon's memory, on
// its own thread. A message waits at most kPatience and is sent without the pictures that are not
// ready then.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "base/blocking/blocking_worker.hpp"
#include "daemon/protocol/answers.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "services/notify/picture/trend_picture.hpp"
#include "services/notify/rules/message.hpp"

namespace loopwarden::notify {

inline constexpr std::size_t kMostPictures = 3;            // per message
inline constexpr std::size_t kMostPictureBytes = 200'000;  // per picture; typical: 30 kB

// Returns the events of a message that get a picture: raised and unacknowledged alarms, one per
// loop. Empty if they are too many to be listed one by one.
std::vector<std::size_t> pictured(const Message& message);

// Returns the displayed stretch: enough before the alarm to show normal behaviour, and the time
// since.
page::history::Stretch stretch_of(const Event& event, double sample_time_s, double accelerate,
                                  std::int64_t now_ms);

class PictureMaker {
 public:
  static constexpr std::chrono::milliseconds kPatience{3000};

  PictureMaker(std::string socket, const date::time_zone* zone);
  PictureMaker(const PictureMaker&) = delete;
  PictureMaker& operator=(const PictureMaker&) = delete;

  // Any thread may call it. Throws only if memory runs out.
  std::vector<Picture> of(const Message& message);
  // Returns false if the thread still hangs at the disk.
  bool stop_for(std::chrono::milliseconds patience) { return task_.stop_for(patience); }

 private:
  std::vector<Picture> draw(const std::vector<std::pair<std::size_t, Event>>& events);
  std::string draw(const Event& event, const protocol::LoopDescription& loop, double accelerate);
  page::history::Curves curves_of(const protocol::LoopDescription& loop, double accelerate,
                                  const page::history::Stretch& stretch, std::int64_t now_ms);

  const date::time_zone* zone_;
  protocol::DaemonClient daemon_;
  base::BlockingWorker task_;  // last member: its thread ends before the others are destroyed
};

}  // namespace loopwarden::notify
