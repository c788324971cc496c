// SPDX-License-Identifier: Apache-2.0
#include "model/estimator/made_move.hpp"

#include <catch2/catch.hpp>
#include <cmath>
#include <cstddef>
#include <limits>
#include <random>
#include <vector>

namespace loopwarden::estimator::made_move_test {
namespace {

using State = MadeMove::State;
using Difference = MadeMove::Difference;

constexpr double kFrom = 5.0;
constexpr double kPeriod_s = 0.5;
constexpr std::size_t kRest = 400;

std::vector<double> rest(std::size_t count, double level = kFrom) {
  return std::vector<double>(count, level);
}

// `hold_s`, `size`: as a person makes it.
std::vector<double> record_of(Move made, double from = kFrom, std::size_t after = kRest) {
  std::vector<double> value = rest(kRest, from);
  const auto count = static_cast<std::size_t>(std::lround(duration_s(made) / kPeriod_s));
  for (std::size_t k = 0; k < count; ++k) {
    value.push_back(moved(made, from, static_cast<double>(k) * kPeriod_s));
  }
  value.insert(value.end(), after, from);
  return value;
}

MadeMove found(const Move& planned, const std::vector<double>& value) {
  return find_move(planned, kFrom, value, kPeriod_s);
}

}  // namespace

TEST_CASE("a move is recognised if size and times are near those of the plan", "[made_move]") {
  const MoveKind kind =
      GENERATE(MoveKind::set_point_pair, MoveKind::set_point_reversal, MoveKind::set_point_stairs,
               MoveKind::set_point_ramp, MoveKind::output_pair, MoveKind::output_reversal,
               MoveKind::output_stairs, MoveKind::output_ramp);
  const double size = GENERATE(0.4, -0.4);
  const Move planned{kind, size, 60.0};
  INFO(to_text(kind) << " " << size);
  // A slow ramp and stairs of small steps count as a drift.
  const auto is_another = [&](const Move& made) {
    const bool gradual = kind == MoveKind::set_point_ramp || kind == MoveKind::output_ramp ||
                         kind == MoveKind::set_point_stairs || kind == MoveKind::output_stairs;
    const State state = found(planned, record_of(made)).state;
    return state == State::other || (gradual && state == State::none);
  };
  SECTION("as planned, nearly so, and from a start nearby") {
    for (const auto& [made, from] : {std::pair{planned, kFrom},
                                     {Move{kind, 1.1 * size, 57.0}, kFrom},
                                     {Move{kind, 0.9 * size, 66.0}, kFrom + 0.1}}) {
      const MadeMove move = found(planned, record_of(made, from));
      CHECK(move.state == State::made);
      CHECK(std::abs(static_cast<double>(move.begin) - static_cast<double>(kRest)) <= 24.0);
      CHECK(move.size == Approx(made.size).epsilon(0.1));
      CHECK(move.from == Approx(from));
      CHECK(move.end > move.begin);
    }
  }
  SECTION("too small, too large or reversed, it is another move") {
    CHECK(is_another({kind, 0.6 * size, 60.0}));
    CHECK(found(planned, record_of({kind, 1.5 * size, 60.0})).state == State::other);
    CHECK(found(planned, record_of({kind, -size, 60.0})).state == State::other);
  }
  SECTION("much faster, slower or elsewhere, it is another move") {
    CHECK(found(planned, record_of({kind, size, 30.0})).state == State::other);
    CHECK(is_another({kind, size, 120.0}));
    const MadeMove elsewhere = found(planned, record_of(planned, kFrom + 1.0));
    CHECK(elsewhere.state == State::other);
    CHECK(elsewhere.difference == Difference::start);
  }
  SECTION("with noise and lost samples it is still recognised") {
    std::vector<double> value = record_of(planned);
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0.0, 0.06 * std::abs(size));
    for (std::size_t k = 0; k < value.size(); ++k) {
      value[k] = k % 7 == 0 ? std::numeric_limits<double>::quiet_NaN() : value[k] + noise(random);
    }
    CHECK(found(planned, value).state == State::made);
  }
  SECTION("until its end it is under way") {
    std::vector<double> value = record_of(planned);
    value.resize(kRest + static_cast<std::size_t>(0.6 * duration_s(planned) / kPeriod_s));
    CHECK(found(planned, value).state == State::under_way);
  }
}

TEST_CASE("a hold that lasts too long is another course", "[made_move]") {
  const Move planned{MoveKind::set_point_pair, 0.4, 60.0};
  std::vector<double> value = rest(kRest);
  value.insert(value.end(), 180, kFrom + 0.4);  // 90 s
  value.insert(value.end(), kRest, kFrom);
  const MadeMove move = found(planned, value);
  CHECK(move.state == State::other);
  CHECK(move.difference == Difference::course);
}

TEST_CASE("a step without return is under way, then another move", "[made_move]") {
  const Move planned{MoveKind::set_point_pair, 0.4, 60.0};
  std::vector<double> value = rest(kRest);
  value.insert(value.end(), 100, kFrom + 0.4);
  CHECK(found(planned, value).state == State::under_way);
  value.insert(value.end(), kRest, kFrom + 0.4);
  CHECK(found(planned, value).state == State::other);
}

TEST_CASE("a move with a hole is not used", "[made_move]") {
  const Move planned{MoveKind::output_pair, 0.4, 60.0};
  std::vector<double> value = record_of(planned);
  for (std::size_t k = kRest + 70; k < kRest + 140; ++k) {
    value[k] = std::numeric_limits<double>::quiet_NaN();
  }
  const MadeMove move = found(planned, value);
  CHECK(move.state == State::other);
  CHECK(move.difference == Difference::missing);
}

TEST_CASE("the planned move is found after another one", "[made_move]") {
  const Move planned{MoveKind::set_point_pair, 0.4, 60.0};
  std::vector<double> value = record_of({MoveKind::set_point_pair, -1.0, 20.0});
  const std::size_t first = value.size();
  const std::vector<double> right = record_of(planned);
  value.insert(value.end(), right.begin(), right.end());
  const MadeMove move = found(planned, value);
  CHECK(move.state == State::made);
  CHECK(move.begin == first + kRest);
}

TEST_CASE("no move is seen at rest, in a drifting signal and in a short record", "[made_move]") {
  const Move planned{MoveKind::set_point_pair, 0.4, 60.0};
  CHECK(found(planned, {}).state == State::none);
  CHECK(found(planned, rest(2000)).state == State::none);
  CHECK(found(planned, rest(30)).state == State::none);
  std::vector<double> drift;
  for (std::size_t k = 0; k < 4000; ++k) drift.push_back(kFrom + 0.002 * static_cast<double>(k));
  CHECK(found(planned, drift).state == State::none);
}

}  // namespace loopwarden::estimator::made_move_test
