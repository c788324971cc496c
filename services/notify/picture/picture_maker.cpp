// SPDX-License-Identifier: Apache-2.0
#include "services/notify/picture/picture_maker.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cmath>
#include <exception>
#include <optional>
#include <set>
#include <utility>

#include "base/clock.hpp"
#include "daemon/protocol/ask.hpp"
#include "record/record_csv.hpp"
#include "services/notify/text/event_text.hpp"
#include "services/notify/text/one_line.hpp"
#include "services/page/history/trend_rows.hpp"

namespace loopwarden::notify {
namespace {

namespace history = page::history;

constexpr std::size_t kPictureStackBytes =
    1024UL * 1024UL;  // fonts need more than the loops' threads do
constexpr std::chrono::milliseconds kDaemonPatience{1000};
constexpr std::size_t kPoints = 1600;  // about three per pixel
constexpr std::int64_t kHour_ms = 3'600'000;

bool asks(const Event& event) {
  return event.change == Change::came || event.change == Change::unacknowledged;
}

std::int64_t came_ms(const Event& event) { return event.utc_ms - event.waits_min * kMinute; }

}  // namespace

std::vector<std::size_t> pictured(const Message& message) {
  std::vector<std::size_t> which;
  if (message.test || message.count() > static_cast<std::int64_t>(kMostGuided)) return which;
  std::set<std::string> loops;
  for (std::size_t i = 0; i < message.events.size() && which.size() < kMostPictures; ++i) {
    const Event& event = message.events[i];
    if (asks(event) && !event.loop.empty() && loops.insert(event.loop).second) which.push_back(i);
  }
  return which;
}

history::Stretch stretch_of(const Event& event, double sample_time_s, double accelerate,
                            std::int64_t now_ms) {
  constexpr double kLeast_s = 600.0;
  constexpr double kSamples = 3.0 * 961.0;  // windows that a verdict waits for, about
  constexpr std::int64_t kLongest_ms = 24 * kHour_ms;
  const double before_s = std::max(kLeast_s, kSamples * sample_time_s) / accelerate;
  const auto before_ms = std::clamp<std::int64_t>(
      std::isfinite(before_s) ? std::llround(std::min(1000.0 * before_s, 12.0 * kHour_ms))
                              : kHour_ms,
      1000, 12 * kHour_ms);
  const std::int64_t at_ms = came_ms(event);
  const std::int64_t to_ms = std::min(now_ms, std::max(at_ms + before_ms / 4, event.utc_ms));
  return {std::max(at_ms - before_ms, to_ms - kLongest_ms), to_ms};
}

PictureMaker::PictureMaker(std::string socket, const date::time_zone* zone)
    : zone_(zone),
      daemon_(std::move(socket), kDaemonPatience),
      task_("lw-picture", kPictureStackBytes) {}

std::vector<Picture> PictureMaker::of(const Message& message) {
  std::vector<std::pair<std::size_t, Event>> events;
  for (const std::size_t i : pictured(message)) events.emplace_back(i, message.events[i]);
  if (events.empty()) return {};
  try {
    auto drawn = task_.ask<std::vector<Picture>>(
        [this, events = std::move(events)] { return draw(events); }, kPatience);
    if (drawn) return std::move(*drawn);
    spdlog::info("message {} is sent without its picture: not ready in time", message.id);
  } catch (const std::exception& e) {
    spdlog::info("message {} is sent without its picture: {}", message.id, one_line(e.what()));
  }
  return {};
}

std::vector<Picture> PictureMaker::draw(const std::vector<std::pair<std::size_t, Event>>& events) {
  const auto about = protocol::ask(daemon_, protocol::DescribeRequest{});
  std::vector<Picture> pictures;
  for (const auto& [place, event] : events) {
    const std::string& tag = event.loop;
    const auto loop = std::find_if(about.loops.begin(), about.loops.end(),
                                   [&](const auto& one) { return one_line(one.tag) == tag; });
    if (loop == about.loops.end()) continue;
    std::string png = draw(event, *loop, about.accelerate);
    if (!png.empty() && png.size() <= kMostPictureBytes)
      pictures.push_back({place, std::move(png)});
  }
  return pictures;
}

std::string PictureMaker::draw(const Event& event, const protocol::LoopDescription& loop,
                               double accelerate) {
  const std::int64_t now_ms = base::utc_ms();
  const history::Stretch stretch = stretch_of(event, loop.sample_time_s, accelerate, now_ms);
  TrendPicture picture{.title = subject_of(event),
                       .zone = zone_,
                       .stretch = stretch,
                       .event_ms = came_ms(event),
                       .pv_unit = loop.pv_unit,
                       .co_unit = loop.co_unit,
                       .pv_range = loop.pv_range,
                       .co_range = loop.co_range,
                       .curves = curves_of(loop, accelerate, stretch, now_ms)};
  if (!loop.stem) picture.curves.columns[history::kStem].assign(picture.curves.t_ms.size(), NAN);
  return png_of(picture);
}

history::Curves PictureMaker::curves_of(const protocol::LoopDescription& loop, double accelerate,
                                        const history::Stretch& stretch, std::int64_t now_ms) {
  constexpr std::int64_t kUsualLag_ms = 2000;
  const auto newer = [&](const std::optional<history::Block>& newest) {
    std::vector<history::Block> rows;
    if (newest && stretch.to_ms - newest->last_ms < kUsualLag_ms) return rows;
    try {
      const auto trend = protocol::ask(daemon_, protocol::TrendRequest{.loop = loop.tag});
      if (trend.period.empty()) return rows;
      const history::LastCycle last{static_cast<double>(trend.period.back()), now_ms,
                                    1000.0 * loop.sample_time_s / accelerate};
      return history::rows_of(trend, last, newest);
    } catch (const protocol::DaemonError& e) {
      spdlog::info("loop {}: {}", loop.tag, one_line(e.what()));
    }
    return rows;
  };
  try {
    return history::History().past(loop.folder, stretch, kPoints, newer).curves;
  } catch (const record::RecordError& e) {
    spdlog::info("loop {}: {}", loop.tag, one_line(e.what()));
  }
  // The curves in the daemon's memory, without a folder.
  return history::History().past({}, stretch, kPoints, newer).curves;
}

}  // namespace loopwarden::notify
