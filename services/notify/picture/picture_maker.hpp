// SPDX-License-Identifier: Apache-2.0
// The pictures of a message's alarms, from the recorder's segments and the daemon's memory. A thread of its own gets and
// draws them: a message waits kPatience at most and goes without what is not there by then.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "base/errand/disk_errand.hpp"
#include "daemon/protocol/answers.hpp"
#include "daemon/protocol/daemon_client.hpp"
#include "services/notify/picture/trend_picture.hpp"
#include "services/notify/rules/message.hpp"

namespace loopwarden::notify {

inline constexpr std::size_t kMostPictures = 3;            // of a message
inline constexpr std::size_t kMostPictureBytes = 200'000;  // of one; usual are 30 kB

// Of which of its events a message has pictures: of those that came or wait, one of each loop. None where they are too many
// to be told one by one.
std::vector<std::size_t> pictured(const Message& message);

// What is shown of it: enough before it came to see what is usual, and what has happened since.
page::history::Stretch stretch_of(const Event& event, double sample_time_s, double accelerate,
                                  std::int64_t now_ms);

class PictureMaker {
 public:
  static constexpr std::chrono::milliseconds kPatience{3000};

  PictureMaker(std::string socket, const date::time_zone* zone);
  PictureMaker(const PictureMaker&) = delete;
  PictureMaker& operator=(const PictureMaker&) = delete;

  // Any thread. Throws nothing but for lack of memory.
  std::vector<Picture> of(const Message& message);
  // False if the thread still hangs at the disk.
  bool stop_for(std::chrono::milliseconds patience) { return errand_.stop_for(patience); }

 private:
  std::vector<Picture> draw(const std::vector<std::pair<std::size_t, Event>>& events);
  std::string draw(const Event& event, const protocol::LoopDescription& loop, double accelerate);
  page::history::Curves curves_of(const protocol::LoopDescription& loop, double accelerate,
                                  const page::history::Stretch& stretch, std::int64_t now_ms);

  const date::time_zone* zone_;
  protocol::DaemonClient daemon_;
  base::DiskErrand errand_;  // the last: its thread ends before the others go
};

}  // namespace loopwarden::notify
