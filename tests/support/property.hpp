// SPDX-License-Identifier: Apache-2.0
// Properties: rules that must hold for all values. rapidcheck draws the values. If a property
// fails, it searches for the smallest failing values and prints them.
//
// The values are the same each time, so that a test that passed passes again. RC_PARAMS="seed=7
// max_success=100000" in the environment tries other and more values.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace loopwarden::tests::property {

// Checks with Catch2 that `one_try` returns without an exception, `tries` times (RC_PARAMS can
// change the number).
void for_all(const std::string& what, int tries, const std::function<void()>& one_try);

// Only for use inside a try. Values begin small and grow from try to try.
std::int64_t integer(std::int64_t low, std::int64_t high);  // both included
std::uint64_t bits();                                       // any 64 bits
bool coin();
std::size_t one_of(std::size_t count);  // 0 to count - 1
// Returns a number of any size between the ends, which are included. Often one of the ends, or
// nearly 0.
double number(double low, double high);

// Ends the try: the property does not hold.
void require(bool holds, const char* what);

}  // namespace loopwarden::tests::property
