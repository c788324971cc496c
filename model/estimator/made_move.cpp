// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/made_move.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <span>

namespace loopwarden::estimator {
namespace {

using State = MadeMove::State;
using Difference = MadeMove::Difference;
using Tolerance = MoveTolerance;

constexpr std::size_t kBlocksPerHold = 10;
constexpr std::size_t kRestBlocks = kBlocksPerHold / 2;
constexpr double kPaceStep = 0.05;
constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

// NaN without a value.
double median_of(std::span<const double> values) {
  std::vector<double> there;
  std::copy_if(values.begin(), values.end(), std::back_inserter(there),
               [](double v) { return std::isfinite(v); });
  if (there.empty()) return kNone;
  const auto middle = there.begin() + static_cast<std::ptrdiff_t>(there.size() / 2);
  std::nth_element(there.begin(), middle, there.end());
  return *middle;
}

class Finder {
 public:
  Finder(const Move& planned, double from, const std::vector<double>& value, double period_s)
      : planned_(planned), from_(from), value_(value), size_(std::abs(planned.size)) {
    const double block = planned.hold_s / period_s / static_cast<double>(kBlocksPerHold);
    per_block_ = std::max<std::size_t>(1, static_cast<std::size_t>(std::lround(block)));
    block_s_ = period_s * static_cast<double>(per_block_);
    for (std::size_t k = 0; k + per_block_ <= value.size(); k += per_block_) {
      blocks_.push_back(median_of(std::span(value).subspan(k, per_block_)));
    }
  }

  MadeMove find() const {
    MadeMove newest;
    double rest = kNone;
    for (std::size_t b = kRestBlocks; b < blocks_.size(); ++b) {
      if (const double now = rest_before(b); std::isfinite(now)) rest = now;
      if (!(std::abs(blocks_[b] - rest) > Tolerance::kDeparts * size_)) continue;
      const MadeMove move = judged(b, rest);
      // The way back of a wrong move is a part of it.
      const bool part = move.state == State::other && newest.end > move.begin;
      if (!part) newest = move;
      if (newest.state == State::made || newest.state == State::under_way) break;
      rest = kNone;  // a wrong move is one move until the signal rests again
    }
    return newest;
  }

 private:
  // NaN: no rest.
  double rest_before(std::size_t b) const {
    const auto before = std::span(blocks_).subspan(b - kRestBlocks, kRestBlocks);
    const double rest = median_of(before);
    const bool rests = std::all_of(before.begin(), before.end(), [&](double v) {
      return std::abs(v - rest) <= Tolerance::kRests * size_;
    });
    return rests ? rest : kNone;
  }

  MadeMove judged(std::size_t first, double rest) const {
    MadeMove move{.state = State::other, .from = rest};
    const bool ramp =
        planned_.kind == MoveKind::set_point_ramp || planned_.kind == MoveKind::output_ramp;
    // A ramp has begun before it departs.
    const std::size_t late =
        ramp ? std::min(first, static_cast<std::size_t>(Tolerance::kDeparts * kBlocksPerHold)) : 0;
    const std::size_t begin = first - late;
    move.begin = (ramp ? begin : begin - 1) * per_block_;  // the median hides the first samples
    while (!ramp && move.begin + 1 < value_.size() &&
           !(std::abs(value_[move.begin] - rest) > Tolerance::kDeparts * size_)) {
      ++move.begin;
    }
    const Course any = course_of(begin, 1.0);
    move.end = std::min(move.begin + any.blocks * per_block_, value_.size());
    const double sign = planned_.size > 0.0 ? 1.0 : -1.0;
    const auto farthest = [&](double side) {
      double most = 0.0;
      for (std::size_t b = begin; b < std::min(begin + any.blocks, blocks_.size()); ++b) {
        if (std::isfinite(blocks_[b])) most = std::max(most, side * (blocks_[b] - rest));
      }
      return most;
    };
    const double there = farthest(sign);
    const double other_side = farthest(-sign);
    move.size = there >= other_side ? sign * there : -sign * other_side;
    if (std::abs(rest - from_) > size_) {
      move.difference = Difference::start;
      return move;
    }
    // The pace that leaves least outside of the tolerance.
    double best = any.blocks > 0 ? std::numeric_limits<double>::infinity() : 0.0;
    double pace = 1.0;
    for (double c = 1.0 - Tolerance::kPace; c < 1.0 + Tolerance::kPace + 1e-9; c += kPaceStep) {
      const double outside = outside_of(begin, rest, c);
      if (outside < best || (outside == best && std::abs(c - 1.0) < std::abs(pace - 1.0))) {
        best = outside;
        pace = c;
      }
    }
    const Course course = course_of(begin, pace);
    if (best > 0.0) {
      const bool too_far = there > (1.0 + Tolerance::kSize) * size_;
      const bool too_small = course.complete && there < (1.0 - Tolerance::kSize) * size_;
      move.difference = too_far || too_small ? Difference::size : Difference::course;
      return move;
    }
    move.end = std::min(begin * per_block_ + course.blocks * per_block_, value_.size());
    if (!course.complete) {
      move.state = State::under_way;
      return move;
    }
    const bool both_sides =
        planned_.kind == MoveKind::set_point_reversal || planned_.kind == MoveKind::output_reversal;
    const double expected_other = both_sides ? size_ : 0.0;
    if (std::abs(there - size_) > Tolerance::kSize * size_ ||
        std::abs(other_side - expected_other) > Tolerance::kSize * size_) {
      move.difference = Difference::size;
    } else if (missing_in(begin, course.blocks) > Tolerance::kMissing) {
      move.difference = Difference::missing;
    } else {
      move.state = State::made;
    }
    return move;
  }

  struct Course {
    std::size_t blocks = 0;  // of the whole move
    bool complete = false;   // the record has all of them, but for one
  };
  Course course_of(std::size_t begin, double pace) const {
    const auto blocks = static_cast<std::size_t>(pace * duration_s(planned_) / block_s_);
    return {blocks, begin + blocks <= blocks_.size() + 1};
  }

  double missing_in(std::size_t begin, std::size_t count) const {
    const auto part = std::span(blocks_).subspan(begin, std::min(count, blocks_.size() - begin));
    const auto missing =
        std::count_if(part.begin(), part.end(), [](double v) { return !std::isfinite(v); });
    return static_cast<double>(missing) / static_cast<double>(count);
  }

  // Number of blocks that have no moment of the plan nearby.
  double outside_of(std::size_t begin, double rest, double pace) const {
    const Course course = course_of(begin, pace);
    double outside = 0.0;
    for (std::size_t b = 0; b < course.blocks && begin + b < blocks_.size(); ++b) {
      const double moved_by = blocks_[begin + b] - rest;
      if (!std::isfinite(moved_by)) continue;
      const double at_s = (static_cast<double>(b) + 0.5) * block_s_ / pace;
      bool near = false;
      for (double shift = -Tolerance::kTime; shift <= Tolerance::kTime + 1e-9 && !near;
           shift += 0.5 / static_cast<double>(kBlocksPerHold)) {
        const double plan = moved(planned_, 0.0, at_s + shift * planned_.hold_s);
        near = std::abs(moved_by - plan) <= Tolerance::kSize * size_;
      }
      if (!near) outside += 1.0;
    }
    return outside;
  }

  const Move& planned_;
  double from_;
  const std::vector<double>& value_;
  double size_;
  std::size_t per_block_ = 1;
  double block_s_ = 0.0;
  std::vector<double> blocks_;
};

}  // namespace

const char* to_text(MadeMove::Difference difference) noexcept {
  switch (difference) {
    case Difference::start: return "it starts elsewhere";
    case Difference::size: return "its size differs";
    case Difference::course: return "its direction, order or times differ";
    case Difference::missing: return "samples are missing";
    case Difference::none: break;
  }
  return "";
}

MadeMove find_move(const Move& planned, double from, const std::vector<double>& value,
                   double period_s) {
  return Finder(planned, from, value, period_s).find();
}

}  // namespace loopwarden::estimator
