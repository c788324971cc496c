// SPDX-License-Identifier: Apache-2.0
// Written by loopwarden-study gap --calibrate; manual changes are lost. Command:
//   loopwarden-study gap --generate 100 --seed 60000 --kinds single,none,pair,outside,controller,further --samples 2000 --names lab/gap_study/confidence/made_from.csv --calibrate model/gap/confidence_table.cpp
//   2026-11-23, 100 cases, seeds 60000 to 60099
// Nine in ten correct names have a remaining error with noise ratio up to 1.05, kurtosis up to 3.3,
// answer to CO up to 1.89.
// clang-format off
#include <array>

#include "model/gap/confidence.hpp"

namespace loopwarden::gap {
namespace {

// nats from, names given, of these right
constexpr std::array kRestIsNoise{
    ConfidenceRow{0, 10, 7},
    ConfidenceRow{11.2439, 10, 9},
    ConfidenceRow{28.2063, 61, 58},
};
constexpr std::array kRestIsMore{
    ConfidenceRow{0, 8, 6},
};

}  // namespace

const ConfidenceTable kConfidenceTable{kRestIsNoise, kRestIsMore, {0, 11, 10}};

}  // namespace loopwarden::gap
