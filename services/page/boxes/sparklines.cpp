// SPDX-License-Identifier: Apache-2.0
#include "services/page/boxes/sparklines.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

namespace loopwarden::page {
namespace {

constexpr float kNone = std::numeric_limits<float>::quiet_NaN();

void append(std::string& text, float value) {
  if (std::isnan(value)) {
    text += "null,";
  } else {
    fmt::format_to(std::back_inserter(text), "{:.5g},", value);
  }
}

void end_list(std::string& text) {
  if (text.back() == ',') text.pop_back();
  text += "],";
}

}  // namespace

void Sparklines::advance(std::int64_t step) {
  const std::int64_t from = std::max(step_ + 1, step - static_cast<std::int64_t>(kSteps) + 1);
  for (std::int64_t empty = from; empty <= step; ++empty) {
    const auto place = static_cast<std::size_t>(empty) % kSteps;
    for (std::size_t loop = 0; loop < loops_; ++loop)
      values_[loop * kSteps + place] = {kNone, kNone, kNone, kNone};
  }
  step_ = step;
}

void Sparklines::add(std::int64_t plant_ms, const std::vector<double>& pv) {
  const std::int64_t step = std::max<std::int64_t>(plant_ms, 0) / kStep_ms;
  if (pv.size() != loops_ || step < step_) {
    *this = Sparklines();
    loops_ = pv.size();
    values_.assign(loops_ * kSteps, {kNone, kNone, kNone, kNone});
  }
  advance(step);
  const auto place = static_cast<std::size_t>(step) % kSteps;
  for (std::size_t loop = 0; loop < loops_; ++loop) {
    Step& one = values_[loop * kSteps + place];
    const auto value = static_cast<float>(pv[loop]);
    if (std::isnan(value)) continue;
    if (std::isnan(one.first)) one.first = value;
    one.low = std::fmin(one.low, value);
    one.high = std::fmax(one.high, value);
    one.last = value;
  }
}

std::string Sparklines::json(std::int64_t until_ms) const {
  std::string text =
      fmt::format("{{\"step_s\":{},\"until_ms\":{},\"pv\":[", kStep_ms / 1000, until_ms);
  for (std::size_t loop = 0; loop < loops_; ++loop) {
    text += '[';
    for (std::size_t i = 1; i <= kSteps; ++i) {
      const Step& one = values_[loop * kSteps + (static_cast<std::size_t>(step_) + i) % kSteps];
      for (const float value : {one.first, one.low, one.high, one.last}) append(text, value);
    }
    end_list(text);
  }
  end_list(text);
  text.back() = '}';
  return text;
}

}  // namespace loopwarden::page
