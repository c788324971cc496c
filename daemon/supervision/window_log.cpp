// SPDX-License-Identifier: Apache-2.0
#include "daemon/supervision/window_log.hpp"

#include <algorithm>

namespace loopwarden::daemon::supervision {

void WindowLog::add(std::int64_t utc_ms, monitor::WindowState state,
                    const monitor::WindowJudgement& judgement) {
  const auto single = [](double value) { return static_cast<float>(value); };
  LoggedWindow window{.utc_ms = utc_ms,
                      .state = state,
                      .result = judgement.result,
                      .fault = judgement.fault,
                      .severity_percent = single(judgement.severity_percent)};
  std::transform(judgement.probability.begin(), judgement.probability.end(),
                 window.probability.begin(), single);
  std::transform(judgement.errors.begin(), judgement.errors.end(), window.errors.begin(), single);
  if (ring_.size() < kKept) {
    ring_.reserve(kKept);
    ring_.push_back(window);
    return;
  }
  ring_[next_] = window;
  next_ = (next_ + 1) % kKept;
}

std::vector<LoggedWindow> WindowLog::windows() const {
  std::vector<LoggedWindow> all(ring_);
  std::rotate(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(next_), all.end());
  return all;
}

}  // namespace loopwarden::daemon::supervision
