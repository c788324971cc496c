// SPDX-License-Identifier: Apache-2.0
// Properties: what must hold whatever the values are. rapidcheck draws them, and where a property does not hold it
// looks for the smallest values that show it and prints them.
//
// The same values each time, so that a test that passed passes again; RC_PARAMS="seed=7 max_success=100000" in the
// environment tries others, and more of them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

namespace loopwarden::tests::property {

// A Catch2 check that `one_try` returns without an exception, `tries` times (RC_PARAMS may say otherwise).
void for_all(const std::string& what, int tries, const std::function<void()>& one_try);

// Inside a try only. Values begin small and grow from try to try.
std::int64_t integer(std::int64_t low, std::int64_t high);  // both included
std::uint64_t bits();                                       // any 64 bits
bool coin();
std::size_t one_of(std::size_t count);  // 0 to count - 1
// Of any size that fits between, ends included: often one of them, or nearly 0.
double number(double low, double high);

// Ends the try: the property does not hold.
void require(bool holds, const char* what);

}  // namespace loopwarden::tests::property
