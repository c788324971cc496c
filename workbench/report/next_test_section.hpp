// SPDX-License-Identifier: Apache-2.0
// A proposed test as HTML: the move in words and as a drawing, and PV as each explanation predicts
// it. Used by the report of gap and by the slip for an operator.
#pragma once

#include <string>

#include "model/gap/result.hpp"

namespace loopwarden::workbench {

// Without a heading.
std::string next_test_section(const gap::NextTest& test);

// A page to print for the operator of another controller: what to move, by how much and until
// when. `tag`: of the loop. `until`: end of its validity.
std::string test_slip_html(const std::string& tag, const gap::NextTest& test,
                           const std::string& until);

}  // namespace loopwarden::workbench
