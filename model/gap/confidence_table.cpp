// SPDX-License-Identifier: Apache-2.0
// Written by loopwarden-study gap --calibrate; what is changed here by hand is lost. Made by:
//   loopwarden_hidden_cases --count 26 --seed 60000 --kinds single,none,pair,outside,controller --samples 2000
//   loopwarden_hidden_cases --count 26 --seed 60052 --load --kinds single,none,pair,outside,controller --samples 2000
//   loopwarden-study gap --gap build/release/bin/loopwarden --cases ... --keep ... --resume --names ...
//   2026-11-22, 17 cases: 60000 to 60008, 60015, 60023 to 60025; with load 60052, 60075 to 60077
// Of the right names nine in ten are given over a rest with noise ratio up to 1.08, kurtosis up to 3.23,
// answer to CO up to 1.41.
// clang-format off
#include <array>

#include "model/gap/confidence.hpp"

namespace loopwarden::gap {
namespace {

// nats from, names given, of these right
constexpr std::array kRestIsNoise{
    ConfidenceRow{0, 8, 8},
};
constexpr std::array kRestIsMore{
    ConfidenceRow{0, 1, 1},
};

}  // namespace

const ConfidenceTable kConfidenceTable{kRestIsNoise, kRestIsMore, {0, 7, 7}};

}  // namespace loopwarden::gap
